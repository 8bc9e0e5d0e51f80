"""`himpc-lab bench`."""

from __future__ import annotations

import sys
from dataclasses import asdict

from app.commands.output import print_table, write_json


def bench(ticks: int = 300, json: str | None = None) -> int:
    """Time the control step: compiled route against the explicit one with DAQP and with ProxQP.

    Times are the whole step, state in and torque out, kinematics included; the contenders take turns.

    Args:
        ticks: timed ticks per contender.
        json: write the result as JSON to this file, or to standard output for "-".
    """
    from lessons.experiments.bench import bench as measure
    from lessons.experiments.bench import ratios
    from robots import InputError

    if not 10 <= ticks <= 100_000:
        raise InputError(f"--ticks is {ticks}: give a number from 10 to 100000")
    if json is None and sys.stderr.isatty():
        from rich.progress import Progress

        with Progress(transient=True) as bar:
            task = bar.add_task("bench …", total=1.0)
            timings = measure(ticks=ticks, progress=lambda share: bar.update(task, completed=share))
    else:
        timings = measure(ticks=ticks)
    if json is not None:
        rows = [asdict(timing) for timing in timings]
        write_json({"scene": "iiwa14-circle", "timings": rows, "ratios": ratios(timings)}, json)
        return 0
    rows = [
        [
            str(timing.horizon),
            timing.route,
            timing.solver,
            *(f"{timing.step_ms[key]:.2f}" for key in ("median", "p95", "p99")),
            f"{timing.qp_ms:.3f}",
        ]
        for timing in timings
    ]
    columns = ("N", "route", "solver", "step ms, median", "p95", "p99", "of it QP solver, median")
    print_table("Control step, iiwa14-circle, three levels", columns, rows)
    return 0

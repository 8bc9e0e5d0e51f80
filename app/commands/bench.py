"""`himpc-lab bench`."""

from __future__ import annotations

from dataclasses import asdict

from app.commands.output import print_table, progress_bar, write_json


def bench(ticks: int = 300, json: str | None = None) -> int:
    """Measure the time of the control step: himpc, and himpc_printed with DAQP and with ProxQP.

    Each time is the time of the whole step from state to torque, kinematics included. The controllers run in
    turns.

    Args:
        ticks: number of timed ticks per controller.
        json: write the result as JSON to this file, or to standard output for "-".
    """
    from lessons.experiments.bench import SCENES, Timing, ratios
    from lessons.experiments.bench import bench as measure
    from robots import InputError

    if not 10 <= ticks <= 100_000:
        raise InputError(f"--ticks is {ticks}: give a number from 10 to 100000")
    found: dict[str, list[Timing]] = {}
    for scene in SCENES:
        with progress_bar(f"bench {scene} …", json is None) as advance:
            found[scene] = measure(scene, ticks=ticks, progress=advance)
    if json is not None:
        blocks = [
            {"scene": scene, "timings": [asdict(timing) for timing in timings], "ratios": ratios(timings)}
            for scene, timings in found.items()
        ]
        write_json({**blocks[0], "dragged": blocks[1]}, json)
        return 0
    columns = ("N", "controller", "solver", "step ms, median", "p95", "p99", "QP solver alone, median")
    for scene, timings in found.items():
        rows = [
            [
                str(timing.horizon),
                timing.controller,
                timing.solver,
                *(f"{timing.step_ms[key]:.2f}" for key in ("median", "p95", "p99")),
                f"{timing.qp_ms:.3f}",
            ]
            for timing in timings
        ]
        dragged = ", dragged" if scene == SCENES[1] else ""
        print_table(f"Control step, {scene}{dragged}, three levels", columns, rows)
    return 0

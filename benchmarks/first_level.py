"""Who keeps the first level at velocity level, and at what cost: HTMPC, HTIDKC and placo in turns.

    python -m benchmarks.first_level [SCENE]

All runs of `ridgeback-ur10-square` advance by one second of simulated time, one after the other in one
process, so that they are disturbed equally. Processor time is measured, so that other programs do not count.
The program prints a table: the mean and the largest error of level 1, mm; the mean error of level 2 in the
first and in the second half, m; the median and the 99th percentile of a step from state to motion command,
and the median share of the QPs, µs.
"""

from __future__ import annotations

import sys
import time

import numpy as np

RUNS = {
    "HTMPC, δ = 1 cm": ("htmpc", ()),
    "HTMPC, δ = 1 mm": ("htmpc", ("delta_m=0.001",)),
    "HTIDKC": ("htidkc", ()),
    "HTIDKC, 5 1/s": ("htidkc", ("gains=[5,0.3]",)),
    "placo, `hard`": ("placo", ("first_level=hard",)),
    "placo, `scaled`": ("placo", ()),
    "placo, `soft`": ("placo", ("first_level=soft",)),
    "placo, `hard`, 5 1/s": ("placo", ("first_level=hard", "gains=[5,0.3]")),
    "placo, `soft`, 5 1/s": ("placo", ("first_level=soft", "gains=[5,0.3]")),
}


def main(scene: str = "ridgeback-ur10-square") -> None:
    """Prints a row of a Markdown table for each run."""
    time.perf_counter_ns = time.thread_time_ns  # before the controllers are imported
    from lessons.scenes.run_spec import RunSpec
    from lessons.scenes.velocity_scene import VelocityScene
    from lessons.session.velocity import VelocitySession

    sessions: dict[str, VelocitySession] = {}
    for name, (controller, changes) in RUNS.items():
        prepared = RunSpec(scene, controller=controller, set=changes).prepared()
        assert isinstance(prepared, VelocityScene)
        sessions[name] = made = VelocitySession(prepared)
        for _ in range(5):
            made.tick()
        made.reset()
    found: dict[str, list[list[float]]] = {name: [] for name in RUNS}
    for second in range(1, 1 + round(next(iter(sessions.values())).scene.duration)):
        for name, session in sessions.items():
            while session.t < second - 1e-9:
                row = session.tick()
                assert session.plan is not None
                errors = (row[session.layout.fields[f"error/{level}"]] for level in session.layout.levels)
                solving = sum(level.time_us for level in session.plan.levels)
                found[name].append([*map(float, map(np.linalg.norm, errors)), session.plan.step_us, solving])
    for name, rows in found.items():
        first, second, step, solving = np.array(rows).T
        away, back = np.array_split(second, 2)
        print(
            f"| {name} | {1e3 * first.mean():.2f} | {1e3 * first.max():.2f} | {away.mean():.2f} | "
            f"{back.mean():.2f} | {np.median(step):.0f} | {np.percentile(step, 99):.0f} | "
            f"{np.median(solving):.0f} |"
        )


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Compares all torque controllers on the same scene with the same seed, as a table.

Prints a line per controller: the RMS error of level 1, the largest torque and velocity as a share of their
limits, the priority leak, and the median time of a step.
"""

from __future__ import annotations

from lessons import Job, RunSpec, perform_all

CONTROLLERS = ("himpc", "hiqp", "weighted", "osf", "tdeosf", "hqp")


def main(seconds: float = 8.0) -> None:
    """Prints the results that the module describes."""
    jobs = [Job(RunSpec("planar3-conflict", controller=name, duration=seconds)) for name in CONTROLLERS]
    # All cores are used, except that timed jobs run one at a time so that they do not disturb each other.
    runs = perform_all(jobs)
    for job in jobs:
        found = runs[job]
        if not found.completed:
            print(f"{job.spec.controller}: lost control at {found.lost_at:.2f} s")
            continue
        measure = "rmse_after_1s" if seconds > 1.0 else "rmse"
        print(
            f"{job.spec.controller}: RMS error {1e3 * found.error_of('position', 0, measure):.4f} mm in x, "
            f"torque {found.figure('limits', 'torque', 'max_ratio'):.2f}, "
            f"velocity {found.figure('limits', 'velocity', 'max_ratio'):.2f} of the limit, "
            f"leak {found.figure('priority_leak_max'):.1e}, "
            f"step {found.figure('step_ms', 'median'):.3f} ms"
        )


if __name__ == "__main__":
    main()

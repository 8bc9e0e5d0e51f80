"""The runs of the HTMPC paper's section V as jobs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lessons.experiments.jobs import Job, JobResult
from lessons.scenes.run_spec import RunSpec
from lessons.settings.missions import random_peaks
from robots.arrays import Array

SQUARE = "ridgeback-ur10-square"
PEAKS_SEED = 0
EE_HOME = np.array([1.490, 0.174])
"""m: the point around which the peaks lie."""
METHODS = {"htmpc": "HTMPC", "htmpc_wpt": "HTMPC_WPT", "htidkc": "HTIDKC"}


def peaks(quick: bool) -> list[tuple[float, float]]:
    """Returns the peak targets of the random square waves, 25, or 4 in the quick version."""
    return random_peaks(PEAKS_SEED, 4 if quick else 25, EE_HOME)


def square(controller: str, peak: tuple[float, float], *assignments: str) -> Job:
    """Returns one square wave."""
    return Job(
        RunSpec(SQUARE, controller=controller, set=(f"peak=[{peak[0]:.9f},{peak[1]:.9f}]", *assignments))
    )


def example(controller: str, *assignments: str) -> Job:
    """Returns the square wave with the scene's own peak; the paper does not print the coordinates of its
    example."""
    return Job(RunSpec(SQUARE, controller=controller, set=assignments))


def part(runs: Sequence[JobResult], index: int, key: str = "normalised_base_error") -> Array:
    """Returns the number `key` of one part of each run; NaN for a run without this part."""
    return np.array([run.figure("parts", index, key) for run in runs])


def hand_mm(run: JobResult) -> tuple[float, float, float]:
    """Mean, standard deviation and maximum of the EE error over the whole run, mm; NaN if it failed."""
    if not len(run.t):
        return float("nan"), float("nan"), float("nan")
    error = 1e3 * np.linalg.norm(run["error/ee"], axis=1)
    return float(error.mean()), float(error.std()), float(error.max())


def normalised(run: JobResult) -> Array:
    """Returns the base error over time, divided by its value at the start of each part."""
    error = np.linalg.norm(run["error/base"], axis=1)
    half = len(error) // 2
    return np.concatenate([error[:half] / error[0], error[half:] / error[half]]) if half else error

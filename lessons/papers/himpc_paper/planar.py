"""Section V, the planar arm: the runs that its tables and figures share."""

from __future__ import annotations

import math

import numpy as np

from lessons.experiments.jobs import Job, JobResult
from lessons.scenes.run_spec import RunSpec

RT1, RT2, RT3 = "planar3-circle", "planar3-conflict", "planar3-singular"
COMPARED = ("osf", "tdeosf", "hqp", "himpc")
ENCODER = ("plant.encoder_resolution_deg=0.00125",)
"""The resolution of the paper's encoders, section V-A."""
SOURCE = "HIMPC (T-RO 2024), section V"

COORDINATES = (("x", "position", 0, "m"), ("y", "position", 1, "m"), ("q1", "q1", 0, "deg"))
"""(label, task, its coordinate, unit) of the rows of Table II."""


def rt1(controller: str, *assignments: str) -> Job:
    """Returns the run of RT1, 8 s."""
    return Job(RunSpec(RT1, controller=controller, set=assignments))


def rt2(controller: str, *assignments: str) -> Job:
    """Returns the run of RT2, 8 s."""
    return Job(RunSpec(RT2, controller=controller, set=assignments))


def rt3(controller: str) -> Job:
    """Returns the run of RT3, 16 s."""
    return Job(RunSpec(RT3, controller=controller))


def level_1(run: JobResult) -> float:
    """Returns the larger RMSE of x and y after the first second, m; NaN if the run was too short for one."""
    return float(np.maximum(run.error_of("position", 0), run.error_of("position", 1)))


def largest_error(run: JobResult) -> float:
    """Returns the largest distance of the EE from its reference, m; infinite if control was lost."""
    if run.error is not None:
        return math.nan
    error = run["error/position"]
    return math.inf if run.lost_at is not None else float(np.linalg.norm(error, axis=1).max())


def whole_run(run: JobResult) -> float:
    """Returns the larger RMSE of x and y over the whole run, m."""
    return float(np.maximum(run.error_of("position", 0, "rmse"), run.error_of("position", 1, "rmse")))


def roughness(run: JobResult) -> float:
    """RMS of ‖Δτ‖ over the run, N·m per tick."""
    steps = run["delta_tau"]
    return float(np.sqrt((steps**2).sum(axis=1).mean())) if len(steps) else math.nan

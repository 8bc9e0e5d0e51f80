"""The summary of a run: the object of `himpc-lab run --json`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from lessons.recording import torque, velocity
from lessons.recording.recording import Recording
from lessons.session.session import Session
from lessons.session.torque import TorqueSession
from lessons.session.velocity import VelocitySession
from lessons.settings.values import finite, peak

_BLOCKS: Mapping[type[Session], Callable[[Recording], dict[str, Any]]] = {
    TorqueSession: torque.block,
    VelocitySession: velocity.block,
}


def summary(recording: Recording) -> dict[str, Any]:
    """Returns the run as one JSON-ready object; its keys are part of the interface of the command line.

    Ratios are relative to the limit in force at that tick, before any tightening. Numbers that are not
    finite become None. Figures that differ between torque and velocity level are in a block of their own.
    """
    session = recording.session
    step_ms = recording["step_us"][:, 0] / 1e3
    return finite(
        {
            "scene": session.scene.name,
            "robot": session.robot.name,
            "controller": session.settings.controller,
            "seed": session.seed,
            "duration_s": round(recording.duration, 9),
            "diverged": session.diverged_at is not None,
            "diverged_at_s": session.diverged_at,
            "finite": bool(np.isfinite(recording["q"]).all() and np.isfinite(recording["tau"]).all()),
            **_BLOCKS[type(session)](recording),
            "priority_leak_max": peak(recording["priority_leak"]),
            "step_ms": {
                "median": float(np.median(step_ms)),
                "p99": float(np.percentile(step_ms, 99)),
                "max": float(step_ms.max()),
            },
            "real_time_factor": recording.duration / recording.wall_s,
        }
    )

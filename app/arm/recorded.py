"""The rows of a drive as named arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.arm.drive import Driven
from app.arm.loop import Columns
from himpc.export.image import Image


def arrays(driven: Driven, image: Image) -> dict[str, Any]:
    """Returns one array per field, a row per period: `t` (s, the arm's clock), `q`, `v` (rad, rad/s), `tau_0`
    and `tau` (N·m without gravity: acting before, set now), `missed` (periods before), `us` (µs for the
    controller and its guard), `fallback`, `ending` (whether the torque is being taken away), `error/TASK` (m
    or rad), and `q_model` and `tau_model` of the simulated robot; also `joint_names`."""
    manifest = image.manifest
    at = Columns.of(len(manifest["joints"]), sum(task["rows"] for task in manifest["tasks"]))
    rows, found = driven.rows, {}
    for name in ("t", "q", "v", "tau_0", "tau", "missed", "us", "fallback", "ending"):
        found[name] = rows[:, getattr(at, name)]
    errors, first = rows[:, at.error], 0
    for task in manifest["tasks"]:
        found[f"error/{task['name']}"] = errors[:, first : first + task["rows"]]
        first += task["rows"]
    found["q_model"], found["tau_model"] = driven.q_model, driven.tau_model
    found["joint_names"] = np.array(manifest["joints"])
    return found

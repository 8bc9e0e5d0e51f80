"""The rows of a drive as named arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.arm.drive import Driven
from app.arm.loop import Columns
from himpc.export.image import Image


def arrays(driven: Driven, image: Image) -> dict[str, Any]:
    """Returns one array per field, with one row per period.

    - `t`: the arm's clock, s; `q`, `v`: rad and rad/s.
    - `tau_0` and `tau`: the torque before this period and the new torque, N·m without gravity.
    - `missed`: number of periods that were missed before this one; `us`: time of the controller and its
      guard, µs.
    - `fallback`: the fallback that acted; `ending`: whether the arm is being stopped; `error/TASK`: m or rad.
    - `q_model`, `tau_model`: the same for the simulated robot; `joint_names`: the names of the joints."""
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

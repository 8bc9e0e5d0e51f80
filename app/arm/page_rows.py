"""Converts the rows of an arm's loop into the rows of telemetry that a page draws."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from app.arm.loop import Columns
from app.arm.model import Model
from himpc.rotation import quaternion
from himpc.telemetry import Layout
from robots import Robot
from robots.arms.arm import ArmLimits

Array = NDArray[np.float64]


@final
class PageRows:
    """Fills rows of telemetry with the data of an arm. Unknown fields are NaN. Torques exclude gravity."""

    def __init__(
        self, layout: Layout, manifest: dict[str, Any], robot: Robot, limits: ArmLimits, period: float
    ) -> None:
        """layout: the layout of the page's rows; manifest: the manifest of the exported controller;
        limits: the limits in force; period: the control period, s."""
        self._tasks = manifest["tasks"]
        self._at = Columns.of(robot.n, sum(task["rows"] for task in self._tasks))
        self._fields = fields = layout.fields
        self._row = np.full(layout.size, np.nan)
        for name, value in (
            ("tau_lower", -limits.tau),
            ("tau_upper", limits.tau),
            ("v_limit", limits.v),
            ("q_lower", limits.q_lower),
            ("q_upper", limits.q_upper),
        ):
            self._row[fields[name]] = value

    def of(self, t: float, row: Array, model: Model) -> Array:
        """Returns the page's row (a buffer) for a row of the loop at t (s since the first row). model: the
        model at the same time; its filtered targets equal those of the arm."""
        at, fields, found = self._at, self._fields, self._row
        found[fields["t"]], found[fields["step_us"]] = t, row[at.us]
        found[fields["late"]] = row[at.missed] > 0
        found[fields["q"]] = found[fields["q_measured"]] = row[at.q]
        found[fields["v"]] = found[fields["v_measured"]] = row[at.v]
        found[fields["tau"]] = found[fields["tau_demand"]] = row[at.tau]
        found[fields["tau_0"]] = row[at.tau_0]
        found[fields["delta_tau"]] = row[at.tau] - row[at.tau_0]
        errors, first = row[at.error], 0
        for task in self._tasks:
            name, span = task["name"], slice(first, first + task["rows"])
            first = span.stop
            if f"error/{name}" not in fields:
                continue
            found[fields[f"error/{name}"]] = errors[span]
            where = fields[f"x_d/{name}"]
            if task["target"] == "orientation":
                found[where] = quaternion(model.R_d[task["index"]])
            elif task["target"] != "none" and where.stop - where.start == task["rows"]:
                found[where] = model.x_d[span]
        return found

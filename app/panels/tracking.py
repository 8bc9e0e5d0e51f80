"""The plots about a velocity-level controller: errors and bounds, solve time, base speed, manipulability."""

from __future__ import annotations

import numpy as np
import viser

from app.history import History
from app.messages import Ready
from app.palette import BOUND, GOOD, JOINTS, LEVELS, RGB
from app.panels.chart import Chart, Line
from app.text import block
from himpc.htmpc import base_joints

_ERROR = (1e-2, 1e4)  # mm or degrees
_TIME = (1e-1, 1e3)  # ms
_W = (1e-4, 1e1)  # m³


class TrackingPlots:
    """Errors on a logarithmic axis: it need not jump to show both a millimetre and three metres."""

    def __init__(self, gui: viser.GuiApi, ready: Ready, colours: dict[str, RGB]) -> None:
        self._tasks = ready.tasks
        self._error = Chart(
            gui,
            "Error per task, mm or °",
            [
                Line(f"{t.name} [{'mm' if t.unit == 'm' else '°'}]", colours[t.level], width=2.0)
                for t in self._tasks
            ]
            + [Line(f"|e*| + δ of {t.name}", colours[t.level], dashed=True) for t in self._tasks],
            _ERROR,
            height=220,
            log=True,
        )
        gui.add_html(
            block("Dashed: the bound under which the levels below must keep a task's error, one knot ahead; "
                  "the last level has none.")
        )  # fmt: skip
        self._time = Chart(
            gui,
            "Control step, ms",
            [Line("whole step", LEVELS[1], width=2.0), Line("period", GOOD, dashed=True, fill=0.12)],
            _TIME,
            height=160,
            log=True,
        )
        self._base = list(base_joints(ready.robot))[:2]
        if self._base:
            self._limit = float(ready.robot.v_limit[self._base].max())
            self._speed = Chart(
                gui,
                "Base speed, m/s",
                [
                    Line("x", JOINTS[0]),
                    Line("y", JOINTS[3]),
                    Line("upper bound", BOUND, dashed=True),
                    Line("lower bound", BOUND, dashed=True),
                ],
                (-1.2 * self._limit, 1.2 * self._limit),
                height=160,
                bands=((2, 3, GOOD),),
            )
        self._w = Chart(
            gui, "Manipulability of the arm w, m³", [Line("w", LEVELS[3])], _W, height=150, log=True
        )

    def draw(self, history: History, T_s: float) -> None:
        fields, columns = history.layout.fields, history.columns
        ages = history.ages(T_s)
        units = [1e3 if task.unit == "m" else np.degrees(1.0) for task in self._tasks]
        step = 1e-3 * columns(fields["step_us"])[:, 0]
        errors = [
            unit * np.linalg.norm(columns(fields[f"error/{task.name}"]), axis=1)
            for task, unit in zip(self._tasks, units, strict=True)
        ]
        bounds = [
            unit * columns(fields[f"bound/{task.level}"])[:, 0]
            for task, unit in zip(self._tasks, units, strict=True)
        ]
        self._error.show(ages, [*errors, *bounds])
        self._time.show(ages, [step, np.full_like(step, 1e3 * T_s)])
        if self._base:
            v, limit = (
                columns(fields["v"])[:, self._base],
                columns(fields["v_limit"])[:, self._base].min(axis=1),
            )
            limit = np.where(np.isfinite(limit), limit, self._limit)
            self._speed.show(ages, [*v.T, limit, -limit])
        self._w.show(ages, [columns(fields["manipulability"])[:, 0]])

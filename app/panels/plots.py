"""The plots about the whole controller: error per level, solve time, leaks."""

from __future__ import annotations

import numpy as np
import viser

from app.history import History
from app.messages import Ready
from app.palette import BAD, BOUND, GOOD, LEVELS, RGB
from app.panels.chart import Chart, Line

_ERROR = (1e-3, 1e3)  # mm or degrees
_TIME = (1e-2, 1e2)  # ms
_LEAK = (1e-12, 1e2)  # m/s² or rad/s²


class LevelPlots:
    """Logarithmic axes: they need not jump to show both a micrometre and a lost level."""

    def __init__(self, gui: viser.GuiApi, ready: Ready, colours: dict[str, RGB]) -> None:
        self._tasks = ready.tasks
        self._levels = tuple(name for name in ready.layout.levels)
        self._error = Chart(
            gui,
            "Error per task, mm or °",
            [
                Line(f"{t.name} [{'mm' if t.unit == 'm' else '°'}]", colours.get(t.level, BOUND))
                for t in self._tasks
            ],
            _ERROR,
            height=200,
            log=True,
        )
        self._time = Chart(
            gui,
            "Control step, ms",
            [
                Line("whole step", LEVELS[1], width=2.0),
                Line("budget", GOOD, dashed=True, fill=0.12),
            ],
            _TIME,
            height=170,
            log=True,
        )
        self._leak = Chart(
            gui,
            "Leak into higher levels, m/s² or rad/s²",
            [Line("priority (own model)", LEVELS[2]), Line("dynamic (true plant)", BAD)],
            _LEAK,
            height=170,
            log=True,
        )

    def draw(self, history: History, T_s: float) -> None:
        fields = history.layout.fields
        ages = history.ages(T_s)
        errors = [
            np.linalg.norm(history.columns(fields[f"error/{task.name}"]), axis=1)
            * (1e3 if task.unit == "m" else np.degrees(1.0))
            for task in self._tasks
        ]
        self._error.show(ages, errors)
        step = 1e-3 * history.columns(fields["step_us"])[:, 0]
        self._time.show(ages, [step, np.full_like(step, 1e3 * T_s)])
        known = np.isfinite(step)
        leaks = [
            np.where(known, np.nan_to_num(history.columns(fields[name])[:, 0], nan=0.0), np.nan)
            for name in ("priority_leak", "dynamic_leak")
        ]
        self._leak.show(ages, leaks)

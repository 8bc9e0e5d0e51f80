"""The plots about a velocity-level controller: errors and bounds, base speed, manipulability; on
request, solve time."""

from __future__ import annotations

import numpy as np

from app.client.recording import BUCKETS, PlotWindow
from app.html.palette import BOUND, GOOD, JOINTS, LEVELS
from app.html.text import block
from app.link.messages import TaskView
from app.panels.widgets.chart import Chart, ChartLine, of_ghost
from app.tab.context import PageContext
from himpc.htmpc import base_joints

_ERROR = (1e-2, 1e4)  # mm or degrees
_TIME = (1e-1, 1e3)  # ms
_W = (1e-4, 1e1)  # m³
_HEIGHT = 184  # px, so that the charts of a row begin and end together


class TrackingPlots:
    """Plots with a logarithmic error axis of fixed range, which shows a millimetre as well as three
    metres."""

    def __init__(self, page: PageContext) -> None:
        gui, self._page, self._tasks = page.gui, page, page.ready.tasks
        self._limits = page.robot.v_limit
        self._base = list(base_joints(page.robot))[:2]
        self._place = gui.add_folder(None)
        self._charts: list[Chart] = []
        gui.add_html(
            block("Dashed: the upper bound of a task's error one knot ahead, which the levels below must "
                  "respect. The last level has no such bound.")
        )  # fmt: skip
        self._inner = gui.add_folder("Computing time", expand_by_default=False)
        self._build(ghost=False)

    def _build(self, ghost: bool) -> None:
        for chart in self._charts:
            chart.remove()
        self._with_ghost = ghost
        errors = [
            ChartLine(f"{t.name} [{'mm' if t.unit == 'm' else '°'}]", self._page.colours[t.level], width=2.0)
            for t in self._tasks
        ]
        bounds = [
            ChartLine(f"|e*| + δ of {t.name}", self._page.colours[t.level], dashed=True) for t in self._tasks
        ]
        step = [ChartLine("whole step", LEVELS[1], width=2.0)]
        period = ChartLine("period", GOOD, dashed=True, fill=0.12)
        w = [ChartLine("w", LEVELS[3])]
        with self._place:
            tracking = [*errors, *bounds, *of_ghost(errors, ghost)]
            self._charts = [
                self._chart("Error per task, mm or °", tracking, _ERROR),
                self._chart("Manipulability of the arm w, m³", [*w, *of_ghost(w, ghost)], _W),
            ]
            if self._base:
                self._charts.append(self._speed(ghost))
        with self._inner:
            lines = [*step, period, *of_ghost(step, ghost)]
            self._charts.append(self._chart("Control step, ms", lines, _TIME))

    def _chart(self, title: str, lines: list[ChartLine], span: tuple[float, float]) -> Chart:
        return Chart(self._page.gui, self._page.in_view, title, lines, span, height=_HEIGHT, log=True)

    def _speed(self, ghost: bool) -> Chart:
        limit = float(self._limits[self._base].max())
        speeds = [ChartLine("x", JOINTS[0]), ChartLine("y", JOINTS[3])]
        return Chart(
            self._page.gui,
            self._page.in_view,
            "Base speed, m/s",
            [
                *speeds,
                ChartLine("upper bound", BOUND, dashed=True),
                ChartLine("lower bound", BOUND, dashed=True),
                *of_ghost(speeds, ghost),
            ],
            (-1.2 * limit, 1.2 * limit),
            height=_HEIGHT,
            bands=((2, 3, GOOD),),
        )

    def draw(self, window: PlotWindow, ghost: PlotWindow | None, T_s: float) -> None:
        """ghost: the ghost's data over the same interval."""
        if (ghost is not None) != self._with_ghost:
            self._build(ghost is not None)
        fields = window.layout.fields
        beside = [] if ghost is None else [ghost]
        windows = [window, *beside]
        error, w, *base, step = self._charts
        error.show(
            window,
            lambda: [
                *self._errors(window),
                *self._bounds(window),
                *(curve for each in beside for curve in self._errors(each)),
            ],
        )
        period = np.full(2 * BUCKETS, 1e3 * T_s)
        step.show(window, lambda: [_times(window), period, *(_times(each) for each in beside)])
        w.show(window, lambda: [each.columns(fields["manipulability"])[:, 0] for each in windows])
        for speed in base:
            speed.show(window, lambda: self._speeds(window, beside))

    def _speeds(self, window: PlotWindow, beside: list[PlotWindow]) -> list[np.ndarray]:
        fields = window.layout.fields
        limit = window.columns(fields["v_limit"])[:, self._base].min(axis=1)
        limit = np.where(np.isfinite(limit), limit, float(self._limits[self._base].max()))
        own, *rest = (each.columns(fields["v"])[:, self._base].T for each in (window, *beside))
        return [*own, limit, -limit, *(curve for each in rest for curve in each)]

    def _bounds(self, window: PlotWindow) -> list[np.ndarray]:
        fields = window.layout.fields
        return [_unit(task) * window.columns(fields[f"bound/{task.level}"])[:, 0] for task in self._tasks]

    def _errors(self, window: PlotWindow) -> list[np.ndarray]:
        fields = window.layout.fields
        return [
            _unit(task) * np.linalg.norm(window.columns(fields[f"error/{task.name}"]), axis=1)
            for task in self._tasks
        ]


def _times(window: PlotWindow) -> np.ndarray:
    return 1e-3 * window.columns(window.layout.fields["step_us"])[:, 0]


def _unit(task: TaskView) -> float:
    return 1e3 if task.unit == "m" else float(np.degrees(1.0))

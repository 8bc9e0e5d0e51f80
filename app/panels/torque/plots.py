"""Plots about the whole controller: errors, torque and speed in % of their bounds, the nearest distance; on
request, solve time and leaks between levels."""

from __future__ import annotations

import numpy as np
import viser

from app.client.recording import BUCKETS, PlotWindow
from app.html.palette import BAD, BOUND, GOOD, JOINTS, LEVELS
from app.html.text import block
from app.panels.run.joints import TORQUE, data_sheet, quantities
from app.panels.widgets.chart import NO_TICK, Chart, ChartLine, of_ghost
from app.tab.context import PageContext
from lessons.settings.torque import TorqueSettings
from robots.collision import Floor

_ERROR = (1e-3, 1e3)  # mm or degrees
_TIME = (1e-2, 1e2)  # ms
_LEAK = (1e-12, 1e2)  # m/s² or rad/s²
_DISTANCE = (0.0, 250.0)  # mm
_SHARE = (0.0, 120.0)  # %
_HEIGHT = 184  # px, so that the charts of a row begin and end together
_NO_PAIR = (
    "Before a tick has run, or if no two links or objects can come close to each other, there is no curve."
)
_COVERS = (
    "The distance is that of the covers of the links, which are a few millimetres thicker than the links. "
    "At 0 the links do not touch yet."
)


class LevelPlots:
    """Plots with logarithmic axes of fixed range. They show an error of a micrometre as well as the large
    error of a level without control. The curves of a ghost are dashed; the page's loop rebuilds the charts
    when a ghost starts or ends."""

    def __init__(
        self,
        page: PageContext,
    ) -> None:
        gui, self._page = page.gui, page
        self._sheet = data_sheet(page.robot, TORQUE)
        self._place = gui.add_folder(None)
        self._inner = gui.add_folder("Computing time and leaks", expand_by_default=False)
        self._charts: list[Chart] = []
        self._covers: viser.GuiHtmlHandle | None = None
        self._furnished = any(not isinstance(thing.shape, Floor) for thing in page.ready.world)
        self._build(ghost=False)

    def rebuild(self) -> None:
        """Rebuilds the charts for other tasks."""
        self._build(self._shown[0])

    def _wanted(self, ghost: bool) -> tuple[bool, bool, bool]:
        """Returns whether there is a ghost, whether contacts are marked, and whether distances are drawn."""
        settings: TorqueSettings = self._page.settings
        kept = settings.limits.avoidance.on
        return ghost, settings.plant.contacts, kept or self._furnished

    def _build(self, ghost: bool) -> None:
        for chart in self._charts:
            chart.remove()
        if self._covers is not None:
            self._covers.remove()
            self._covers = None
        self._shown = self._wanted(ghost)
        _, contacts, distances = self._shown
        errors = [
            ChartLine(f"{t.name} [{'mm' if t.unit == 'm' else '°'}]", self._page.colours.get(t.level, BOUND))
            for t in self._page.ready.tasks
        ]
        step = [ChartLine("whole step", LEVELS[1], width=2.0)]
        leaks = [ChartLine("priority (own model)", LEVELS[2]), ChartLine("dynamic (true plant)", BAD)]
        near = [ChartLine("nearest pair", LEVELS[0], width=2.0)]
        shares = [ChartLine("torque", JOINTS[0], width=2.0), ChartLine("speed", JOINTS[3], width=2.0)]
        errors, step, leaks, near, shares = (
            [*lines, *of_ghost(lines, ghost)] for lines in (errors, step, leaks, near, shares)
        )
        kept = ChartLine("bound: no closer", BAD, dashed=True, fill=0.12)
        # An area over the whole height marks the time in which the robot touches something.
        errors += [ChartLine("contact", BAD, fill=0.12, width=0.0)] if contacts else []
        budget = ChartLine("budget", GOOD, dashed=True, fill=0.12)
        bound = ChartLine("bound", BOUND, dashed=True)
        with self._place:
            self._charts = [
                self._chart("Error per task, mm or °", errors, _ERROR),
                self._chart("Joint nearest its bound, %", [*shares, bound], _SHARE),
            ]
            if distances:
                title = "Distance of the nearest pair, mm"
                self._charts.append(self._chart(title, [*near, kept], _DISTANCE, empty=_NO_PAIR))
                self._covers = self._page.gui.add_html(block(_COVERS))
        with self._inner:
            self._charts += [
                self._chart("Control step, ms", [*step, budget], _TIME),
                self._chart("Leak into higher levels, m/s² or rad/s²", leaks, _LEAK),
            ]

    def _chart(
        self,
        title: str,
        lines: list[ChartLine],
        span: tuple[float, float],
        empty: str = NO_TICK,
    ) -> Chart:
        log = span not in (_DISTANCE, _SHARE)
        return Chart(
            self._page.gui, self._page.in_view, title, lines, span, height=_HEIGHT, log=log, empty=empty
        )

    def draw(self, window: PlotWindow, ghost: PlotWindow | None) -> None:
        """Draws the plots of the window. ghost: the ghost's data over the same interval. If the plant has
        contacts, the plot of errors marks them. If distances are kept, there is a plot of them."""
        if self._wanted(ghost is not None) != self._shown:
            self._build(ghost is not None)
        windows, T_s = [window] if ghost is None else [window, ghost], self._page.settings.T_s
        error, share, *distance, step, leak = self._charts
        error.show(window, lambda: self._errors_and_contacts(window, windows))
        share.show(window, lambda: [*self._shares(windows), np.full(2 * BUCKETS, 100.0)])
        step.show(window, lambda: [*(_times(each) for each in windows), np.full(2 * BUCKETS, 1e3 * T_s)])
        leak.show(window, lambda: [curve for each in windows for curve in _leaks(each)])
        for near in distance:
            near.show(window, lambda: _distances(window, windows))

    def _shares(self, windows: list[PlotWindow]) -> list[np.ndarray]:
        """Returns torque and speed of the joint that is nearest its bound, %."""
        return [
            np.abs(quantity.shares()).max(axis=1)
            for window in windows
            for quantity in quantities(window, TORQUE, self._sheet)[:2]
        ]

    def _errors_and_contacts(self, window: PlotWindow, windows: list[PlotWindow]) -> list[np.ndarray]:
        curves = [curve for each in windows for curve in self._errors(each)]
        return [*curves, touching(window)] if self._shown[1] else curves

    def _errors(self, window: PlotWindow) -> list[np.ndarray]:
        fields = window.layout.fields
        nothing = np.full(2 * BUCKETS, np.nan)  # a ghost that does not have the new stack yet
        return [
            np.linalg.norm(window.columns(fields[f"error/{task.name}"]), axis=1)
            * (1e3 if task.unit == "m" else np.degrees(1.0))
            if f"error/{task.name}" in fields
            else nothing
            for task in self._page.ready.tasks
        ]


def _times(window: PlotWindow) -> np.ndarray:
    return 1e-3 * window.columns(window.layout.fields["step_us"])[:, 0]


def _leaks(window: PlotWindow) -> list[np.ndarray]:
    fields = window.layout.fields
    known = np.isfinite(window.columns(fields["t"])[:, 0])
    return [
        np.where(known, np.nan_to_num(window.columns(fields[name])[:, 0], nan=0.0), np.nan)
        for name in ("priority_leak", "dynamic_leak")
    ]


def _distances(window: PlotWindow, windows: list[PlotWindow]) -> list[np.ndarray]:
    drawn = [*((each, "distance") for each in windows), (window, "distance_kept")]
    return [1e3 * each.columns(each.layout.fields[field])[:, 0] for each, field in drawn]


def touching(window: PlotWindow) -> np.ndarray:
    """Returns the top of the axis of errors while the robot touches something, otherwise the bottom of the
    axis."""
    force = window.columns(window.layout.fields["contact_force"])[:, 0]
    return np.where(np.nan_to_num(force) > 0.0, _ERROR[1], 0.0)

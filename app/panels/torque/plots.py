"""Plots about the whole controller: error per level, solve time, and leaks between levels."""

from __future__ import annotations

import numpy as np
import viser

from app.client.decimated import BUCKETS, PlotWindow
from app.html.palette import BAD, BOUND, GOOD, LEVELS, RGB
from app.link.messages import Ready
from app.panels.widgets.chart import Chart, ChartLine, of_ghost
from app.panels.widgets.in_view import InView

_ERROR = (1e-3, 1e3)  # mm or degrees
_TIME = (1e-2, 1e2)  # ms
_LEAK = (1e-12, 1e2)  # m/s² or rad/s²


class LevelPlots:
    """Plots with logarithmic axes of fixed range, which show an error of a micrometre and the large error of
    a level without control. The curves of a ghost are dashed; the page's loop rebuilds the charts when a
    ghost starts or ends."""

    def __init__(self, gui: viser.GuiApi, in_view: InView, ready: Ready, colours: dict[str, RGB]) -> None:
        self._gui, self._in_view = gui, in_view
        self._tasks, self._colours = ready.tasks, colours
        self._place = gui.add_folder(None)
        self._charts: list[Chart] = []
        self._build(ghost=False, contacts=ready.settings.plant.contacts)

    def rebuild(self, ready: Ready) -> None:
        """Rebuilds the charts for other tasks."""
        self._tasks = ready.tasks
        self._build(self._with_ghost, self._with_contacts)

    def _build(self, ghost: bool, contacts: bool) -> None:
        for chart in self._charts:
            chart.remove()
        self._with_ghost, self._with_contacts = ghost, contacts
        errors = [
            ChartLine(f"{t.name} [{'mm' if t.unit == 'm' else '°'}]", self._colours.get(t.level, BOUND))
            for t in self._tasks
        ]
        step = [ChartLine("whole step", LEVELS[1], width=2.0)]
        leaks = [ChartLine("priority (own model)", LEVELS[2]), ChartLine("dynamic (true plant)", BAD)]
        errors, step, leaks = ([*lines, *of_ghost(lines, ghost)] for lines in (errors, step, leaks))
        # An area over the whole height: the time in which the robot touches something.
        errors += [ChartLine("contact", BAD, fill=0.12, width=0.0)] if contacts else []
        budget = ChartLine("budget", GOOD, dashed=True, fill=0.12)
        with self._place:
            self._charts = [
                Chart(self._gui, self._in_view, title, lines, span, height=height, log=True)
                for title, lines, span, height in (
                    ("Error per task, mm or °", errors, _ERROR, 200),
                    ("Control step, ms", [*step, budget], _TIME, 170),
                    ("Leak into higher levels, m/s² or rad/s²", leaks, _LEAK, 170),
                )
            ]

    def draw(self, window: PlotWindow, ghost: PlotWindow | None, T_s: float, contacts: bool) -> None:
        """ghost: the ghost's data over the same interval; contacts: whether the plant has contacts, which
        the plot of errors marks."""
        if (ghost is not None, contacts) != (self._with_ghost, self._with_contacts):
            self._build(ghost is not None, contacts)
        windows = [window] if ghost is None else [window, ghost]
        error, step, leak = self._charts
        error.show(window, lambda: self._errors_and_contacts(window, windows))
        step.show(window, lambda: [*(_times(each) for each in windows), np.full(2 * BUCKETS, 1e3 * T_s)])
        leak.show(window, lambda: [curve for each in windows for curve in _leaks(each)])

    def _errors_and_contacts(self, window: PlotWindow, windows: list[PlotWindow]) -> list[np.ndarray]:
        curves = [curve for each in windows for curve in self._errors(each)]
        return [*curves, touching(window)] if self._with_contacts else curves

    def _errors(self, window: PlotWindow) -> list[np.ndarray]:
        fields = window.layout.fields
        nothing = np.full(2 * BUCKETS, np.nan)  # a ghost that does not have the new stack yet
        return [
            np.linalg.norm(window.columns(fields[f"error/{task.name}"]), axis=1)
            * (1e3 if task.unit == "m" else np.degrees(1.0))
            if f"error/{task.name}" in fields
            else nothing
            for task in self._tasks
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


def touching(window: PlotWindow) -> np.ndarray:
    """The top of the axis of errors while the robot touches something, else its bottom."""
    force = window.columns(window.layout.fields["contact_force"])[:, 0]
    return np.where(np.nan_to_num(force) > 0.0, _ERROR[1], 0.0)

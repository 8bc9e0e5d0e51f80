"""The tabs about the whole controller, at both levels: errors, bounds and, on request, computing time; and
the constraints that bind, with the time that each joint spent at its bounds."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from app.client.recording import BUCKETS, PlotWindow
from app.html.palette import BAD, BOUND, GOOD, JOINTS, LEVELS
from app.html.text import block, esc, joints_named, swatch
from app.link.messages import TaskView
from app.panels.run.joints import TORQUE, data_sheet, quantity
from app.panels.widgets.chart import ChartLine, Charts, Plot
from app.tab.context import PageContext, SessionSnapshot
from himpc.htmpc import base_joints
from himpc.limits import CONSTRAINTS
from lessons.settings.settings import SceneSettings
from lessons.settings.torque import TorqueSettings
from robots.collision import Floor

_ERROR, _TIME = (1e-3, 1e3), (1e-2, 1e2)  # mm or degrees; ms: at torque level
_FAR, _LONG = (1e-2, 1e4), (1e-1, 1e3)  # the same at velocity level
_LEAK = (1e-12, 1e2)  # m/s² or rad/s²
_DISTANCE = (0.0, 250.0)  # mm
_SHARE = (0.0, 120.0)  # %
_W = (1e-4, 1e1)  # m³
_NO_PAIR = (
    "Before a tick has run, or if no two links or objects can come close to each other, there is no curve."
)
_COVERS = (
    "The distance is that of the covers of the links, which are a few millimetres thicker than the links. "
    "At 0 the links do not touch yet."
)
_DASHED = (
    "Dashed: the upper bound of a task's error one knot ahead, which the levels below must respect. The last "
    "level has no such bound."
)


class Shown(NamedTuple):
    """The charts of a scene: those that are always shown, a text below them, and the others in a folder that
    is closed at first."""

    plots: list[Plot]
    note: str
    folder: str
    more: list[Plot]


class PlotsPanel:
    """Plots with logarithmic axes of fixed range. They show an error of a micrometre as well as the large
    error of a level without control."""

    def __init__(self, page: PageContext, shown: Callable[[PageContext], Shown]) -> None:
        """shown: returns the charts for the present settings and stack."""
        self._page, self._shown = page, shown
        _, note, folder, _ = shown(page)
        self._charts = Charts(page)
        if note:
            page.gui.add_html(block(note))
        self._more = Charts(page, page.gui.add_folder(folder, expand_by_default=False))

    def draw(self, window: PlotWindow, ghost: PlotWindow | None) -> None:
        """ghost: the ghost's data over the same interval."""
        shown = self._shown(self._page)
        self._charts.draw(shown.plots, window, ghost)
        self._more.draw(shown.more, window, ghost)


def torque_plots(page: PageContext) -> Shown:
    """Returns the charts of a torque-level scene. If the plant has contacts, the chart of errors marks them.
    If distances are kept, or if there are objects, there is a chart of the nearest distance."""
    settings: TorqueSettings = page.settings
    tasks = page.ready.tasks
    contacts = (ChartLine("contact", BAD, fill=0.12, width=0.0),) if settings.plant.contacts else ()
    plots = [
        Plot(
            "Error per task, mm or °",
            _ERROR,
            _task_lines(page),
            lambda window: _errors(window, tasks),
            # An area over the whole height marks the time in which the robot touches something.
            contacts,
            lambda window: [touching(window) for _ in contacts],
        ),
        Plot(
            "Joint nearest its bound, %",
            _SHARE,
            (ChartLine("torque", JOINTS[0], width=2.0), ChartLine("speed", JOINTS[3], width=2.0)),
            lambda window: _shares(window, page),
            (ChartLine("bound", BOUND, dashed=True),),
            lambda _: [np.full(2 * BUCKETS, 100.0)],
            log=False,
        ),
    ]
    if settings.limits.avoidance.on or any(not isinstance(each.shape, Floor) for each in page.ready.world):
        plots.append(
            Plot(
                "Distance of the nearest pair, mm",
                _DISTANCE,
                (ChartLine("nearest pair", LEVELS[0], width=2.0),),
                lambda window: [1e3 * _column(window, "distance")],
                (ChartLine("bound: no closer", BAD, dashed=True, fill=0.12),),
                lambda window: [1e3 * _column(window, "distance_kept")],
                log=False,
                empty=_NO_PAIR,
                note=_COVERS,
            )
        )
    leaks = Plot(
        "Leak into higher levels, m/s² or rad/s²",
        _LEAK,
        (ChartLine("priority (own model)", LEVELS[2]), ChartLine("dynamic (true plant)", BAD)),
        _leaks,
    )
    return Shown(plots, "", "Computing time and leaks", [_step(page, "budget", _TIME), leaks])


def velocity_plots(page: PageContext) -> Shown:
    """Returns the charts of a velocity-level scene; that of the base's speed only for a mobile robot."""
    tasks, base = page.ready.tasks, list(base_joints(page.robot))[:2]
    plots = [
        Plot(
            "Error per task, mm or °",
            _FAR,
            _task_lines(page, width=2.0),
            lambda window: _errors(window, tasks),
            tuple(ChartLine(f"|e*| + δ of {t.name}", page.colours[t.level], dashed=True) for t in tasks),
            lambda window: [_unit(t) * _column(window, f"bound/{t.level}") for t in tasks],
        ),
        Plot(
            "Manipulability of the arm w, m³",
            _W,
            (ChartLine("w", LEVELS[3]),),
            lambda window: [_column(window, "manipulability")],
        ),
    ]
    if base:
        most = float(page.robot.v_limit[base].max())

        def limits(window: PlotWindow) -> list[np.ndarray]:
            limit = window.columns(window.layout.fields["v_limit"])[:, base].min(axis=1)
            limit = np.where(np.isfinite(limit), limit, most)
            return [limit, -limit]

        plots.append(
            Plot(
                "Base speed, m/s",
                (-1.2 * most, 1.2 * most),
                (ChartLine("x", JOINTS[0]), ChartLine("y", JOINTS[3])),
                lambda window: list(window.columns(window.layout.fields["v"])[:, base].T),
                (ChartLine("upper bound", BOUND, dashed=True), ChartLine("lower bound", BOUND, dashed=True)),
                limits,
                log=False,
                bands=((2, 3, GOOD),),
            )
        )
    return Shown(plots, _DASHED, "Computing time", [_step(page, "period", _LONG)])


def _step(page: PageContext, bound: str, span: tuple[float, float]) -> Plot:
    T_s = page.settings.T_s
    return Plot(
        "Control step, ms",
        span,
        (ChartLine("whole step", LEVELS[1], width=2.0),),
        lambda window: [1e-3 * _column(window, "step_us")],
        (ChartLine(bound, GOOD, dashed=True, fill=0.12),),
        lambda _: [np.full(2 * BUCKETS, 1e3 * T_s)],
    )


def _task_lines(page: PageContext, width: float = 1.6) -> tuple[ChartLine, ...]:
    return tuple(
        ChartLine(
            f"{t.name} [{'mm' if t.unit == 'm' else '°'}]", page.colours.get(t.level, BOUND), width=width
        )
        for t in page.ready.tasks
    )


def _column(window: PlotWindow, field: str) -> np.ndarray:
    return window.columns(window.layout.fields[field])[:, 0]


def _errors(window: PlotWindow, tasks: tuple[TaskView, ...]) -> list[np.ndarray]:
    fields = window.layout.fields
    nothing = np.full(2 * BUCKETS, np.nan)  # a ghost that does not have the new stack yet
    return [
        _unit(task) * np.linalg.norm(window.columns(fields[f"error/{task.name}"]), axis=1)
        if f"error/{task.name}" in fields
        else nothing
        for task in tasks
    ]


def _unit(task: TaskView) -> float:
    return 1e3 if task.unit == "m" else float(np.degrees(1.0))


def _shares(window: PlotWindow, page: PageContext) -> list[np.ndarray]:
    """Returns torque and speed of the joint that is nearest its bound, %."""
    sheet = data_sheet(page.robot, TORQUE)
    shown = (quantity(window, TORQUE, sheet, kind).shares() for kind in (0, 1))
    return [np.abs(shares).max(axis=1) for shares in shown]


def _leaks(window: PlotWindow) -> list[np.ndarray]:
    known = np.isfinite(_column(window, "t"))
    return [
        np.where(known, np.nan_to_num(_column(window, name), nan=0.0), np.nan)
        for name in ("priority_leak", "dynamic_leak")
    ]


def touching(window: PlotWindow) -> np.ndarray:
    """Returns the top of the axis of errors while the robot touches something, otherwise the bottom of the
    axis."""
    return np.where(np.nan_to_num(_column(window, "contact_force")) > 0.0, _ERROR[1], 0.0)


_ALWAYS = 3
"""Constraints that every robot has: torque, velocity and position. Other constraints get a column once they
bind."""
_HEAD = '<tr style="text-align:left">{}</tr>'


class BindingPanel:
    """Two tables: the active constraints, and the time at bounds."""

    def __init__(self, page: PageContext) -> None:
        gui, self._colours = page.gui, page.colours
        gui.add_html(
            block("A bound <b>binds</b> (is active) when the plan stops at it. The multiplier is the rate at "
                  "which the level's cost would fall if the bound were moved outwards. For costs without the "
                  "factor ½, such as (31), the rate is twice the multiplier. The slack is the distance by "
                  "which the bound was softened.")
        )  # fmt: skip
        with gui.add_folder("Binding now"):
            self._now = gui.add_html("")
        with gui.add_folder("Time at bounds since the reset"):
            self._times = gui.add_html("")

    def update(self, now: SessionSnapshot[SceneSettings]) -> None:
        rows = "".join(
            f"<tr><td>{swatch(self._colours.get(row.level, BOUND))}{esc(row.level)}</td>"
            f"<td>{esc(readable(row.joint))}</td><td>{esc(row.kind)} {esc(row.side)}</td>"
            f"<td>{row.multiplier:.3g}</td><td>{row.slack:.2g}</td></tr>"
            for row in now.status.binding
        )
        nearest = f"<p>Nearest pair: {esc(readable(now.status.nearest))}.</p>" if now.status.nearest else ""
        self._now.content = block(
            nearest + _table(("level", "joint or pair", "bound", "multiplier", "slack"), rows)
            if rows
            else f"No bound is binding: every level is limited only by the levels above it.{nearest}"
        )
        robot = now.ready.robot
        shown = [place for place in range(now.bound_seconds.shape[1])
                 if place < _ALWAYS or now.bound_seconds[:, place].any()]  # fmt: skip
        spent = "".join(
            f"<tr><td>{esc(readable(name))}</td>"
            + "".join(f"<td>{s:.2f} s</td>" for s in seconds[shown])
            + "</tr>"
            for name, seconds in zip(robot.joint_names, now.bound_seconds, strict=True)
            if seconds.any()
        )
        titles = ("joint", *(CONSTRAINTS[place].label for place in shown))
        self._times.content = block(_table(titles, spent) if spent else "None so far.")


def readable(pair: str) -> str:
    """Returns the names of a pair as words, "link 5 – table" for "link_5 – table", or that of a joint."""
    return pair.replace("_", " ") if " – " in pair else joints_named(pair)


def _table(titles: tuple[str, ...], rows: str) -> str:
    head = _HEAD.format("".join(f'<th style="padding-right:0.8em">{title}</th>' for title in titles))
    table = f'<table style="border-spacing:0.3em 0.1em">{head}{rows}</table>'
    return f'<div tabindex="0" style="overflow-x:auto">{table}</div>'

"""The mission as a list of completed, active and future tasks, with the buttons that change it, and a row for
the point that each level moves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser

from app.html.palette import GOOD, RGB, button, css
from app.html.text import badge, block, esc, free_name, quantity, swatch
from app.link.messages import MissionRow
from app.panels.widgets.command import on_click
from app.panels.widgets.controls import Controls
from app.panels.widgets.level_row import LevelRow
from app.tab.context import PageContext, SessionSnapshot
from lessons.events import InsertTask, MoveLevel, Release, RemoveTask
from lessons.settings.missions import ArchitectureOptions, PerceptionOptions
from lessons.settings.velocity import VelocitySettings

_EARLIER, _LATER, _REMOVE = "▲ Earlier", "▼ Later", "Remove"
_END, _NOTHING = "at the end", "–"
_DONE_SHOWN = 3


class MissionPanel:
    """The list of tasks, the button Release, and controls that insert, remove and reorder tasks."""

    def __init__(self, page: PageContext, places: Callable[[], dict[str, np.ndarray]]) -> None:
        """places: returns the position at which each role's goal is drawn, (3,) m."""
        gui, settings = page.gui, page.settings
        controls, options = Controls(gui, page.bindings, settings), settings.options
        self._points = {task.name: task for task in page.ready.tasks if task.kind == "position"}
        self._page, self._places = page, places
        self._filled = False
        self._list = gui.add_html("")
        self._swap = gui.add_button("Swap which comes first", hint="The first two tasks change places")
        self._release = gui.add_button("Release", visible=False, color=button(GOOD))
        if isinstance(options, PerceptionOptions):
            with gui.add_folder("Reported position of the crate"):
                controls.add("false_report", "report_start", "report_end")
                controls.add_elements(
                    "report_offset", ("x [m]", "y [m]", "z [m]"), "Reported minus true position"
                )
        if isinstance(options, ArchitectureOptions):
            with gui.add_folder("Execution of the mission, from the next Reset", expand_by_default=False):
                controls.add("architecture", "base_tolerance", "base_at_rest")
        with gui.add_folder("Change a task"):
            self._task = gui.add_dropdown("Task", _options())
            self._change = gui.add_button_group("Change", (_EARLIER, _LATER, _REMOVE))
        with gui.add_folder("Add a task", expand_by_default=False):
            self._role = gui.add_dropdown("Point", tuple(self._points))
            self._goal = gui.add_vector3(
                "Goal [m]", (0.0, 0.0, 0.0), step=0.05, hint="A base uses only x and y"
            )
            self._before = gui.add_dropdown("Before", _options(_END))
            hold = gui.add_checkbox("Hold until released", False)
            add = gui.add_button("Add")

        on_click(self._swap, lambda: swap(page))

        @self._release.on_click
        async def _(_: object) -> None:
            waiting = _waiting(page.mission_rows or ())
            if waiting is not None:
                page.post(Release(waiting.name))

        on_click(self._change, lambda: self._changed(str(self._change.value), str(self._task.value)))

        @self._role.on_update
        async def _(_: object) -> None:
            self._goal.value = self._start()

        on_click(add, lambda: self._add(bool(hold.value)))

    def _start(self) -> tuple[float, float, float]:
        """Returns the position at which the role's goal is drawn now. A new goal of this role begins at this
        position."""
        x, y, z = self._places().get(str(self._role.value), np.zeros(3))
        return round(float(x), 2), round(float(y), 2), round(float(z), 2)

    def _changed(self, what: str, name: str) -> None:
        ahead = [row.name for row in self._page.mission_rows or () if row.state != "done"]
        if name not in ahead:
            return
        if what == _REMOVE:
            self._page.post(RemoveTask(name))
            return
        to = ahead.index(name) + (-1 if what == _EARLIER else 1)
        if 0 <= to < len(ahead):
            self._page.post(MoveLevel(name, to))

    def _add(self, hold: bool) -> None:
        role, before = str(self._role.value), str(self._before.value)
        axes = self._points[role].axes
        goal = tuple(float(self._goal.value["xyz".index(axis)]) for axis in axes)
        name = free_name(f"{role} added", [row.name for row in self._page.mission_rows or ()])
        self._page.post(
            InsertTask(name, role, goal, None if before == _END else before, hold=None if hold else 0.0)
        )

    def update(self, now: SessionSnapshot[VelocitySettings]) -> None:
        mission = now.status.mission
        if mission is None:
            return
        self._list.content = block(_listed(mission.rows, self._page.colours, mission.done))
        ahead = tuple(row.name for row in mission.rows if row.state != "done")
        for menu, options in ((self._task, _options(*ahead)), (self._before, _options(_END, *ahead))):
            if menu.options != options:
                menu.options = options
        if not self._filled:
            self._filled = True
            self._goal.value = self._start()
        waiting = _waiting(mission.rows)
        self._swap.visible = len(ahead) > 1
        self._release.visible = waiting is not None
        if waiting is not None:
            self._release.label = f"Release {waiting.name}"


def swap(page: PageContext) -> None:
    """Moves the second open task to the first place."""
    ahead = [row.name for row in page.mission_rows or () if row.state != "done"]
    if len(ahead) > 1:
        page.post(MoveLevel(ahead[1], 0))


def _options(*names: str) -> tuple[str, ...]:
    """Returns the options of a menu, which must not be empty."""
    return names or (_NOTHING,)


def _waiting(rows: tuple[MissionRow, ...]) -> MissionRow | None:
    """Returns the first open task, if it lasts until it is released; otherwise None."""
    first = next((row for row in rows if row.state != "done"), None)
    return first if first is not None and first.hold is None else None


def _listed(rows: tuple[MissionRow, ...], colours: dict[str, RGB], done: bool) -> str:
    first = next((row for row in rows if row.state != "done"), None)
    over = max(0, sum(row.state == "done" for row in rows) - _DONE_SHOWN)
    lines = "".join(_line(row, colours, first is row) for row in rows[over:])
    if over:
        lines = f"<tr><td>✓</td><td colspan='3' style='opacity:0.55'>earlier tasks: {over}</td></tr>{lines}"
    head = (
        badge("MISSION DONE", GOOD) if done else f"{sum(r.state == 'done' for r in rows)} of {len(rows)} done"
    )
    return (
        f"{head}<div style='max-height:17em;overflow-y:auto;margin-top:0.3em'>"
        f"<table style='width:100%;border-spacing:0 0.1em'>{lines}</table></div>"
    )


def _line(row: MissionRow, colours: dict[str, RGB], first: bool) -> str:
    colour = colours[row.role]
    mark = {"done": "✓", "active": "▶" if first else "▷", "ahead": ""}[row.state]
    style = {
        "done": "opacity:0.55",
        "active": f"background:{css(colour, 0.16)};font-weight:{600 if first else 400}",
        "ahead": "",
    }[row.state]
    return (
        f"<tr style='{style}'><td style='width:1.3em;text-align:center'>{mark}</td>"
        f"<td>{swatch(colour)}{esc(row.name)}</td><td>{_where(row.goal)}</td><td>{_when(row)}</td></tr>"
    )


def _where(goal: tuple[float, ...] | None) -> str:
    if goal is None:
        return "a given trajectory"
    if len(goal) == 4:
        return "orientation of its rings"
    return "(" + ", ".join(f"{x:.2f}" for x in goal) + ") m"


def _when(row: MissionRow) -> str:
    if row.done_at is not None:
        return f"{row.done_at:.1f} s"
    if row.there_s is not None:
        return "there, until released" if row.hold is None else f"holds {row.there_s:.1f} / {row.hold:g} s"
    if row.hold is None:
        return "until released"
    return f"hold {row.hold:g} s" if row.hold else ""


class RolesPanel:
    """One row per role, in the order of the mission's window."""

    def __init__(self, page: PageContext, strip: viser.GuiTabHandle | None) -> None:
        """strip: the tab of a panel over the scene, which shows the rows, too."""
        levels = page.settings.levels
        self._order = tuple(level.name for level in levels)
        page.gui.add_html(block("The mission below sets the order of the levels."), order=-1.0)
        hints = "On or off", "⋯: the weight of this level"
        self._rows = {
            level.name: LevelRow(page, level, place, hints, strip) for place, level in enumerate(levels)
        }
        for name, row in self._rows.items():
            with row.details:
                Controls(page.gui, page.bindings, page.settings).add(f"levels.{name}.Q")

    def toggle(self, place: int) -> None:
        """Switches the level at an index (0-based) on or off, if there is such a level."""
        for name in self._order[place : place + 1]:
            self._rows[name].toggle()

    def update(self, now: SessionSnapshot[VelocitySettings]) -> None:
        places = {level.name: now.number(f"level/{level.name}") for level in now.settings.levels}
        inside = sorted((name for name in places if places[name] == places[name]), key=places.__getitem__)
        self._order = (*inside, *(name for name in places if name not in inside))
        levels = {level.name: level for level in now.settings.levels}
        for name, row in self._rows.items():
            level = levels[name]
            task, error = level.tasks[0], now.error(level.tasks[0].name)
            bound, has_task = now.number(f"bound/{name}"), name in inside
            row.update(
                self._order.index(name),
                level.enabled,
                error if has_task else 0.0,
                f"<b>{quantity(error, task.unit)}</b>" if has_task else "no task now",
                f"≤ {quantity(bound, task.unit)}" if has_task and bound == bound else "",
                "Levels below may increase the error of this level to this bound",
                now.fallback(name) if has_task else "",
            )

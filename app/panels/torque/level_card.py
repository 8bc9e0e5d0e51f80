"""One level in the list of tasks: its error and rank, gains and weights, and its buttons."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.html.palette import BAD, BOUND, DAMPING, RGB, css
from app.html.text import badge, block, esc, quantity, swatch
from app.panels.torque.joint_targets import Targets, add_joint_targets
from app.panels.torque.task_editor import TaskEditor
from app.panels.widgets.controls import Controls
from app.panels.widgets.mirror import Bindings
from app.panels.widgets.snapshot import SessionSnapshot
from himpc.stack import Level
from himpc.telemetry import FALLBACKS
from lessons.events import Set
from lessons.settings.torque import TorqueSettings
from robots import Robot

UP, DOWN = "▲ Up", "▼ Down"
LINES = 3
"""Number of lines of the longest usual text about a level, in a panel of the usual width."""


class LevelCard:
    """The folder of one level."""

    def __init__(
        self,
        gui: viser.GuiApi,
        bindings: Bindings[TorqueSettings],
        settings: TorqueSettings,
        level: Level,
        colours: dict[str, RGB],
        place: int,
        robot: Robot,
        targets: Callable[[], Targets],
        moves: Bindings[Targets],
        shift: Callable[[str, int], None],
        unfolded: bool,
    ) -> None:
        """targets: returns the present targets, which `moves` shows; shift: moves the level with this name by
        a number of places; unfolded: whether the controls that edit the tasks are unfolded."""
        name = self.name = level.name
        self._colour = colours.get(name, BOUND)
        self._folder = gui.add_folder(_title(place, name), order=float(place))
        with self._folder:
            self._live = gui.add_html(block("", lines=LINES))
            on = gui.add_checkbox("Enabled", level.enabled, hint=f"Key {place + 1}")
            move = gui.add_button_group("Priority", (UP, DOWN))
            add_joint_targets(gui, moves, level, robot, targets)
            with gui.add_folder("Gains and weights", expand_by_default=False):
                controls = Controls(gui, bindings, settings)
                for task in level.tasks:
                    if len(level.tasks) > 1:
                        gui.add_html(block(f"<b>{esc(task.name)}</b>"))
                    controls.add(f"tasks.{task.name}.K_p", f"tasks.{task.name}.K_v")
                controls.add(f"levels.{name}.Q", f"levels.{name}.R")
            with gui.add_folder("Change", expand_by_default=unfolded):
                for task in level.tasks:
                    TaskEditor(gui, bindings, task, robot, alone=len(level.tasks) == 1)
                if place > 0:
                    above = settings.levels[place - 1].name
                    merge = gui.add_button("Merge with the level above")
                    merge.on_click(lambda _: bindings.post(Set("stack.merge", [name, above])))
        bindings.bind(
            on,
            lambda s: any(each.enabled for each in s.levels if each.name == name),
            lambda value: Set(f"levels.{name}.enabled", bool(value)),
        )

        @move.on_click
        async def _(_: object) -> None:
            shift(name, -1 if move.value == UP else 1)

    def update(self, now: SessionSnapshot[TorqueSettings], level: Level, place: int) -> None:
        title = _title(place, level.name)
        if self._folder.label != title:
            self._folder.label = title
            self._folder.order = float(place)
        errors = ", ".join(
            (f"{esc(task.name)} " if len(level.tasks) > 1 else "")
            + f"error <b>{quantity(now.error(task.name), task.unit)}</b>"
            for task in level.tasks
        )
        notes = "" if level.enabled else " " + badge("OFF", DAMPING)
        fallback = now.number(f"rung/{level.name}")
        if level.enabled and fallback == fallback and fallback > 0:
            notes += " " + badge(FALLBACKS[int(fallback)], BAD)
        self._live.content = block(
            f"{swatch(self._colour)}{errors}{notes}{_rank(now.status.ranks.get(level.name))}",
            f"border-left:3px solid {css(self._colour)}",
            LINES,
        )


def _title(place: int, name: str) -> str:
    return f"{place + 1} · {name}"


def _rank(found: tuple[int, int] | None) -> str:
    """Returns a sentence with the number of directions that the level gets, and the number of its rows."""
    if found is None:
        return ""
    rank, rows = found
    short = (
        "" if rank == rows else ": the levels above use the other directions, or the arm cannot move in them"
    )
    return f"<br>gets {rank} of {rows} directions{short}"

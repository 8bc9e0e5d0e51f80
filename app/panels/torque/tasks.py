"""The stack as an ordered list of levels with their tasks, and the form for one more task."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import viser

from app.client.pending_edit import PendingEdit
from app.html.palette import DAMPING, RGB
from app.html.text import block, formula, swatch
from app.panels.torque.add_task import AddTask
from app.panels.torque.joint_targets import Targets
from app.panels.torque.level_card import LevelCard
from app.panels.widgets.mirror import Bindings
from app.panels.widgets.snapshot import SessionSnapshot
from lessons.events import Event, MoveLevel, Set
from lessons.settings.torque import TorqueSettings
from robots import Robot


class TasksPanel:
    """One folder per level, in the order of priority. Another stack needs other folders: see `rebuild`."""

    def __init__(
        self,
        gui: viser.GuiApi,
        bindings: Bindings[TorqueSettings],
        loop: asyncio.AbstractEventLoop,
        robot: Robot,
        colours: dict[str, RGB],
        current: Callable[[], TorqueSettings],
        targets: Callable[[], Targets],
        in_lesson: bool,
    ) -> None:
        """bindings: for controls that exist in every stack; loop: viser's event loop; current, targets:
        return the present settings and targets; in_lesson: true if a lesson forbids other stacks."""
        self._gui, self._loop, self._colours = gui, loop, colours
        self._current, self._targets = current, targets
        self._robot, self._in_lesson = robot, in_lesson
        self._post, self._edited = bindings.post, ""
        gui.add_html(
            block(
                "The level with the highest priority is first. Each level gets the freedom that the levels "
                "above leave."
            ),
            order=-1.0,
        )
        self._place = gui.add_folder(None, order=0.0)
        self._build(current())
        with gui.add_folder("Last level: damping", order=900.0):
            damping = gui.add_checkbox(
                "Damp what no level controls",
                current().damping,
                hint="R weighs changes of torque only, so a direction without a task keeps its torque and "
                "does not stop when pushed. This last level stops the motion. Switch the level off and push.",
            )
            self._damping = gui.add_html("")
        bindings.bind(damping, lambda s: s.damping, lambda on: Set("damping", bool(on)))
        with gui.add_folder("What a level minimises", expand_by_default=False, order=901.0):
            gui.add_html(formula(r"e = \ddot x - \ddot x_d + K_V (\dot x - \dot x_d) + K_P (x - x_d)"))
            gui.add_html(formula(r"\sum_j Q \lVert e_{k+j} \rVert^2 + R \lVert \Delta\tau_{k+j} \rVert^2"))
            gui.add_html(
                block(
                    "subject to every bound, and to the condition that no <i>e</i> of the levels above "
                    "changes. This condition makes the priority strict."
                )
            )

    def _build(self, settings: TorqueSettings) -> None:
        self._order: PendingEdit[tuple[str, ...]] = PendingEdit()
        self._enabled: dict[str, PendingEdit[bool]] = {level.name: PendingEdit() for level in settings.levels}
        self._bindings: Bindings[TorqueSettings] = Bindings(self._ask, self._loop)
        self._moves: Bindings[Targets] = Bindings(self._post, self._loop)
        with self._place:
            self._levels = self._gui.add_folder(None)
        with self._levels:
            self._cards = [
                LevelCard(
                    self._gui,
                    self._bindings,
                    settings,
                    level,
                    self._colours,
                    place,
                    self._robot,
                    self._targets,
                    self._moves,
                    self._move,
                    unfolded=any(task.name == self._edited for task in level.tasks),
                )
                for place, level in enumerate(settings.levels)
            ]
            if not self._in_lesson:
                self._add = AddTask(
                    self._gui, self._post, self._robot, settings.levels, dict(settings.own_tasks)
                )

    def _ask(self, event: Event) -> None:
        """Posts an edit. The folder of the edited task stays unfolded in the resulting stack."""
        match event:
            case (
                Set("stack.edit", {"name": str(name)})
                | Set("stack.rename", [_, str(name)])
                | Set("stack.split", str(name))
            ):
                self._edited = name
            case _:
                self._edited = ""
        self._post(event)

    def rebuild(self) -> None:
        """Shows the new stack."""
        self.close()
        self._levels.remove()
        self._build(self._current())

    @property
    def picking(self) -> bool:
        """Whether a click on a link chooses a frame."""
        return not self._in_lesson and self._add.picking

    def choose(self, frame: str) -> None:
        """Chooses the frame for the new task. Called when a link was clicked; `frame` is its frame."""
        self._add.choose(frame)

    def toggle(self, place: int) -> Set | None:
        """Returns the event for the hotkey of an index (0-based); None if there is no such level."""
        levels = {level.name: level for level in self._current().levels}
        names = self._order.now(tuple(levels))
        if place >= len(names) or names[place] not in levels:
            return None
        name = names[place]
        wish = self._enabled.setdefault(name, PendingEdit())
        return Set(f"levels.{name}.enabled", wish.ask(not wish.now(levels[name].enabled)))

    def _move(self, name: str, by: int) -> None:
        """Moves a level one place up (−1) or down (+1), if possible."""
        names = list(self._order.now(tuple(level.name for level in self._current().levels)))
        to = names.index(name) + by if name in names else -1
        if 0 <= to < len(names):
            names.remove(name)
            names.insert(to, name)
            self._order.ask(tuple(names))
            self._post(MoveLevel(name, to))

    def update(self, now: SessionSnapshot[TorqueSettings]) -> None:
        for place, level in enumerate(now.settings.levels):
            for card in self._cards:
                if card.name == level.name:
                    card.update(now, level, place)
        self._bindings.refresh(now.settings)
        self._moves.refresh(self._targets())
        cost = now.number("cost/damping")
        busy = cost == cost
        self._damping.content = block(
            swatch(DAMPING)
            + (
                "takes part: the levels above leave freedom"
                if busy
                else "not needed: the levels above use all freedom"
                if now.settings.damping
                else "off"
            )
        )

    def close(self) -> None:
        """Stops all updates before the controls are removed."""
        self._bindings.close()
        self._moves.close()

"""The controls that change the name, frame and axes of a task while the robot moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import viser

from app.html.palette import BAD, RGB, button
from app.html.text import block, esc
from app.panels.widgets.mirror import Bindings
from himpc.tasks import Task
from himpc.tasks.axes import OnAxes
from himpc.tasks.kinds import said
from himpc.tasks.pointing import DIRECTIONS
from lessons.events import Set
from lessons.settings.torque import TorqueSettings
from robots import Robot

AXES = ("xyz", "xy", "xz", "yz", "x", "y", "z")


class TaskEditor:
    """The controls of one task. Each is in an unnamed folder, see `Controls`."""

    def __init__(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], task: Task, robot: Robot, alone: bool
    ) -> None:
        """alone: whether the task has a level of its own."""
        self._gui, self._bindings, self._task = gui, bindings, task
        name = task.name
        gui.add_html(block(f"<b>{esc(name)}</b>: {esc(said(task))}"))
        if hasattr(task, "frame"):
            self._menu("Frame", "frame", robot.frames, robot.tip)
        if hasattr(task, "root"):
            self._menu("Seen from", "root", robot.frames, robot.frames[0])
        if hasattr(task, "axis"):
            self._menu("Axis", "axis", DIRECTIONS, "z")
        if isinstance(task, OnAxes):
            self._menu("Axes", "axes", AXES if task.axes in AXES else (*AXES, task.axes), "xyz")
        with gui.add_folder(None):
            text = gui.add_text("Name", name)
        self._button("Rename", lambda: Set("stack.rename", [name, text.value[:100]]))
        if not alone:
            self._button(f"Own level for {name}", lambda: Set("stack.split", name))
        self._button(f"Remove {name}", lambda: Set("stack.remove", name), BAD)

    def _menu(self, label: str, field: str, options: Sequence[str], usual: str) -> None:
        """usual: the meaning of an empty field."""
        name = self._task.name

        def read(settings: TorqueSettings) -> str:
            tasks = (task for level in settings.levels for task in level.tasks if task.name == name)
            return str(getattr(next(tasks, self._task), field, "")) or usual

        with self._gui.add_folder(None):
            now = str(getattr(self._task, field)) or usual
            menu = self._gui.add_dropdown(label, tuple(options), initial_value=now)
        self._bindings.bind(menu, read, lambda value: Set("stack.edit", {"name": name, field: str(value)}))

    def _button(self, label: str, event: Callable[[], Set], colour: RGB | None = None) -> None:
        self._gui.add_button(label, color=colour and button(colour)).on_click(
            lambda _: self._bindings.post(event())
        )

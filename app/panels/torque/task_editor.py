"""The forms for a task: for a new one, and to change name, frame and axes while the robot moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any

import viser

from app.html.palette import BAD, RGB, button
from app.html.text import block, esc, joint_labels
from app.tab.context import PageContext
from app.tab.mirror import Bindings
from himpc.stack import Stack
from himpc.tasks import KINDS, Task
from himpc.tasks.axes import OnAxes
from himpc.tasks.kinds import description
from himpc.tasks.pointing import DIRECTIONS
from lessons.events import Set
from lessons.settings.torque import TorqueSettings
from robots import Robot

AXES = ("xyz", "xy", "xz", "yz", "x", "y", "z")
_NORMALS = {"z, the floor": (0.0, 0.0, 1.0), "x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0)}
_TOGETHER = "together with "
_OWN = "a level of its own, at place "


class TaskEditor:
    """The controls of one task. Each is in an unnamed folder, see `Controls`."""

    def __init__(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], task: Task, robot: Robot, alone: bool
    ) -> None:
        """alone: whether the task has a level of its own."""
        self._gui, self._bindings, self._task = gui, bindings, task
        name = task.name
        gui.add_html(block(f"<b>{esc(name)}</b>: {esc(description(task))}"))
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


class AddTask:
    """A folder whose controls depend on the chosen kind of task. The button Add creates the task."""

    def __init__(self, page: PageContext) -> None:
        gui, robot, stack = page.gui, page.robot, page.settings.levels
        own = self._own = dict(page.settings.own_tasks)  # tasks of the user's own files, by path
        self._joints = dict(zip(joint_labels(robot.joint_names), robot.joint_names, strict=True))
        with gui.add_folder("Add a task", expand_by_default=False, order=899.0):
            self._kind = gui.add_dropdown("Kind", (*KINDS, *own), initial_value="position")
            self._says = gui.add_html("")

            def menu(label: str, options: Sequence[str], first: str, hint: str | None = None) -> Any:
                with gui.add_folder(None):
                    return gui.add_dropdown(label, tuple(options), initial_value=first, hint=hint)

            frames, places = robot.frames, _places(stack)
            self._frame = menu("Of frame", frames, robot.tip, "You can also click a link, see below")
            with gui.add_folder(None):
                self._pick = gui.add_checkbox(
                    "Click a link",
                    False,
                    hint="While this is on, a click on a link of the robot chooses the link",
                )
            self._root = menu("As seen from", frames, frames[0])
            self._axes = menu("Along axes", AXES, AXES[0])
            self._axis = menu("Its axis", DIRECTIONS, "z")
            self._normal = menu("Plane across", tuple(_NORMALS), next(iter(_NORMALS)))
            self._joint = menu("Of joint", tuple(self._joints), next(iter(self._joints)))
            self._level = menu("On level", places, places[1])
            with gui.add_folder(None):
                self._name = gui.add_text("Its name", "", hint="If empty, the name of the kind")
            self._add = gui.add_button("Add")
        self._add.on_click(lambda _: page.post(Set("stack.add", self._wish())))
        self._kind.on_update(lambda _: self._show())
        self._show()

    @property
    def picking(self) -> bool:
        """Whether a click on a link chooses the frame."""
        return bool(self._pick.value)

    def choose(self, frame: str) -> None:
        """Chooses the link that was clicked."""
        if frame in self._frame.options:
            self._frame.value = frame

    def _needs(self) -> set[str]:
        own = self._own.get(self._kind.value)
        found = {each.name for each in fields(own or KINDS[self._kind.value].makes[0])}
        return found - {"joints"} if self._kind.value in ("posture", "damping") else found

    def _show(self) -> None:
        needs = self._needs()
        own = self._own.get(self._kind.value)
        self._says.content = block(esc(description(own)) if own else KINDS[self._kind.value].says)
        for field, handle in (
            ("frame", self._frame),
            ("frame", self._pick),
            ("root", self._root),
            ("axes", self._axes),
            ("axis", self._axis),
            ("normal", self._normal),
            ("joints", self._joint),
        ):
            handle.visible = field in needs

    def _wish(self) -> dict[str, Any]:
        needs = self._needs()
        given = {
            "frame": self._frame.value,
            "root": self._root.value,
            "axes": self._axes.value,
            "axis": self._axis.value,
            "normal": list(_NORMALS[self._normal.value]),
            "joints": [self._joints[self._joint.value]],
        }
        wish: dict[str, Any] = {"task": self._kind.value}
        wish |= {field: value for field, value in given.items() if field in needs}
        if self._name.value.strip():
            wish["name"] = self._name.value.strip()[:100]
        level = self._level.value
        if level.startswith(_TOGETHER):
            return wish | {"with": level.removeprefix(_TOGETHER)}
        return wish | {"level": int(level.removeprefix(_OWN))}


def _places(stack: Stack) -> tuple[str, ...]:
    own = [f"{_OWN}{place}" for place in range(1, len(stack) + 2)]
    return (*own, *(f"{_TOGETHER}{level.name}" for level in stack))

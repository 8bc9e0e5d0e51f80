"""The stack as an ordered list of levels with their tasks, and the forms for a task: for a new one, and to
change name, frame and axes while the robot moves."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from app.html.palette import BAD, DAMPING, RGB, button
from app.html.text import block, esc, formula, joint_labels, joints_named, swatch
from app.panels.widgets.controls import Controls
from app.panels.widgets.level_row import LevelRow, error_in_words
from app.tab.context import PageContext, SessionSnapshot
from app.tab.mirror import Bindings, PendingEdit
from himpc.stack import Level, Stack
from himpc.tasks import KINDS, Joints, Posture, Task
from himpc.tasks.axes import OnAxes
from himpc.tasks.kinds import description
from himpc.tasks.pointing import DIRECTIONS
from lessons.events import Event, MoveLevel, MoveTarget, Set
from lessons.settings.torque import TorqueSettings
from robots import Robot
from robots.joints import joint_axis

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


Targets = Mapping[str, NDArray[np.float64]]
"""The raw targets that can be moved, by task."""

_TURN, _WAY = np.pi, 2.0
"""Range of a slider on both sides of zero for a joint without limits, rad and m."""


def _rank(found: tuple[int, int] | None) -> str:
    """Returns a sentence with the number of directions that the level gets, and the number of its rows."""
    if found is None:
        return ""
    rank, rows = found
    short = (
        "" if rank == rows else ": the levels above use the other directions, or the arm cannot move in them"
    )
    return f"This level gets {rank} of {rows} directions{short}"


def add_joint_targets(
    gui: viser.GuiApi, bindings: Bindings[Targets], level: Level, robot: Robot, targets: Callable[[], Targets]
) -> None:
    """Adds a folder with a slider for each joint of every joint-space task whose target can be moved. If
    there is no such task, no folder is added.

    targets: returns the present targets. A target is sent as a whole: if several sliders move at once, each
    change includes the changes that the other sliders have already requested.
    """
    tasks = [task for task in level.tasks if isinstance(task, (Joints, Posture)) and task.name in targets()]
    if not tasks:
        return
    with gui.add_folder("Joint targets", expand_by_default=False):
        for task in tasks:
            wish: PendingEdit[tuple[float, ...]] = PendingEdit()
            for place, joint in enumerate(task.coordinates(robot)):
                name = joints_named(joint)
                label = name if len(tasks) == 1 else f"{task.name}: {name}"
                with gui.add_folder(None):
                    _add_slider(gui, bindings, label, robot, joint, task.name, place, wish, targets)


def _add_slider(
    gui: viser.GuiApi,
    bindings: Bindings[Targets],
    label: str,
    robot: Robot,
    joint: str,
    task: str,
    place: int,
    wish: PendingEdit[tuple[float, ...]],
    targets: Callable[[], Targets],
) -> None:
    at = robot.joint_names.index(joint)
    unit, factor, step, far = (
        ("m", 1.0, 0.001, _WAY)
        if joint_axis(robot.model, robot.joints[at])[0]
        else ("°", np.degrees(1.0), 0.1, _TURN)
    )
    digits = round(-np.log10(step))

    def shown(now: Targets) -> float:
        return round(float(now[task][place] * factor), digits)

    value = shown(targets())
    low, high = robot.q_lower[at], robot.q_upper[at]
    unbounded = not high - low < 10 * far
    slider = gui.add_slider(
        f"{label}, {unit}",
        min=min(value, _inside(-far if unbounded else low, factor, digits)),
        max=max(value, -_inside(-(far if unbounded else high), factor, digits)),
        step=step,
        initial_value=value,
        hint="Target position of the joint, within the joint's limits",
    )

    def event(given: float) -> MoveTarget:
        wanted = list(wish.now(tuple(targets()[task].tolist())))
        wanted[place] = given / factor
        return MoveTarget(task, wish.ask(tuple(wanted)))

    def read(now: Targets) -> float:
        # After a change of the stack, the targets may not contain this task until the sliders are rebuilt.
        value = shown(now) if task in now else slider.value
        return min(max(value, slider.min), slider.max)

    bindings.bind(slider, read, event)


def _inside(low: float, factor: float, digits: int) -> float:
    """Returns the smallest number with `digits` decimals that is not below a limit."""
    return float(np.ceil(low * factor * 10**digits - 1e-6) / 10**digits)


class TasksPanel:
    """One row per level, in the order of priority. Another stack needs other folders: see `rebuild`."""

    def __init__(
        self, page: PageContext, targets: Callable[[], Targets], strip: viser.GuiTabHandle | None
    ) -> None:
        """targets: returns the present targets; strip: the tab of a panel over the scene, which shows the
        rows, too. In a lesson, whose stack is given, no task can be added."""
        gui = page.gui
        self._page, self._targets = page, targets
        self._edited, self._strip = "", strip
        gui.add_html(block("Each level gets the freedom that the levels above leave."), order=-1.0)
        self._place = gui.add_folder(None, order=0.0)
        self._build(opened=())
        with gui.add_folder("Last level: damping", order=900.0):
            damping = gui.add_checkbox(
                "Damp what no level controls",
                page.settings.damping,
                hint="R weighs changes of torque only, so a direction without a task keeps its torque and "
                "does not stop when pushed. This last level stops the motion. Switch the level off and push.",
            )
            self._damping = gui.add_html("")
        page.bindings.bind(damping, lambda s: s.damping, lambda on: Set("damping", bool(on)))
        with gui.add_folder("What a level minimises", expand_by_default=False, order=901.0):
            gui.add_html(formula(r"e = \ddot x - \ddot x_d + K_V (\dot x - \dot x_d) + K_P (x - x_d)"))
            gui.add_html(formula(r"\sum_j Q \lVert e_{k+j} \rVert^2 + R \lVert \Delta\tau_{k+j} \rVert^2"))
            gui.add_html(
                block(
                    "subject to every bound, and to the condition that no <i>e</i> of the levels above "
                    "changes. This condition makes the priority strict."
                )
            )

    def _build(self, opened: Collection[str]) -> None:
        """opened: the names of the levels whose settings are open."""
        self._order: PendingEdit[tuple[str, ...]] = PendingEdit()
        self._bindings: Bindings[TorqueSettings] = Bindings(self._ask, self._page.loop)
        self._moves: Bindings[Targets] = Bindings(self._page.post, self._page.loop)
        with self._place:
            self._levels = self._page.gui.add_folder(None)
        self._rows_over_scene: viser.GuiFolderHandle | None = None
        if self._strip is not None:
            with self._strip:
                self._rows_over_scene = self._page.gui.add_folder(None)
        with self._levels:
            self._rows = {
                level.name: self._add_level(level, place, level.name in opened)
                for place, level in enumerate(self._page.settings.levels)
            }
            if not self._page.in_lesson:
                self._add = AddTask(self._page)

    def _add_level(self, level: Level, place: int, opened: bool) -> LevelRow:
        """Adds the row of a level, with its settings, which may be open, and the controls that edit its
        tasks. These are unfolded if one of the tasks was just edited."""
        page, name, settings = self._page, level.name, self._page.settings
        unfolded = any(task.name == self._edited for task in level.tasks)
        hint = f"On or off: key {place + 1}. ▲ ▼: priority"
        hints = hint, f"{hint}. ⋯: gains, weights and tasks of this level"
        row = LevelRow(page, level, place, hints, self._rows_over_scene, opened or unfolded, self._move)
        with row.details:
            controls = Controls(page.gui, self._bindings, settings)
            controls.add(f"levels.{name}.Q", f"levels.{name}.R")
            for task in level.tasks:
                if len(level.tasks) > 1:
                    page.gui.add_html(block(f"<b>{esc(task.name)}</b>"))
                controls.add(f"tasks.{task.name}.K_p", f"tasks.{task.name}.K_v")
            add_joint_targets(page.gui, self._moves, level, page.robot, self._targets)
            with page.gui.add_folder("Change", expand_by_default=unfolded):
                for task in level.tasks:
                    TaskEditor(page.gui, self._bindings, task, page.robot, alone=len(level.tasks) == 1)
                if place > 0:
                    above = settings.levels[place - 1].name
                    merge = page.gui.add_button("Merge with the level above")
                    merge.on_click(lambda _: self._bindings.post(Set("stack.merge", [name, above])))
        return row

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
        self._page.post(event)

    def rebuild(self) -> None:
        """Shows the new stack."""
        opened = {name for name, row in self._rows.items() if row.details.visible}
        self.close()
        self._levels.remove()
        if self._rows_over_scene is not None:
            self._rows_over_scene.remove()
        self._build(opened)

    @property
    def picking(self) -> bool:
        """Whether a click on a link chooses a frame."""
        return not self._page.in_lesson and self._add.picking

    def choose(self, frame: str) -> None:
        """Chooses the frame for the new task. Called when a link was clicked; `frame` is its frame."""
        self._add.choose(frame)

    def _names(self) -> tuple[str, ...]:
        """The names of the levels in the order that the learner asked for last."""
        return self._order.now(tuple(level.name for level in self._page.settings.levels))

    def toggle(self, place: int) -> None:
        """Switches the level at an index (0-based) on or off, if there is such a level."""
        for name in self._names()[place : place + 1]:
            if name in self._rows:
                self._rows[name].toggle()

    def _move(self, name: str, by: int) -> None:
        """Moves a level one place up (−1) or down (+1), if possible."""
        names = list(self._names())
        to = names.index(name) + by if name in names else -1
        if 0 <= to < len(names):
            names.remove(name)
            names.insert(to, name)
            self._order.ask(tuple(names))
            self._page.post(MoveLevel(name, to))

    def update(self, now: SessionSnapshot[TorqueSettings]) -> None:
        for place, level in enumerate(now.settings.levels):
            row = self._rows.get(level.name)
            if row is None:
                continue  # the rows are not rebuilt yet
            errors = [(task.name, now.error(task.name), task.unit) for task in level.tasks]
            rank = now.status.ranks.get(level.name)
            row.update(
                place,
                level.enabled,
                max((value for _, value, _ in errors), default=0.0),
                error_in_words(errors),
                "" if rank is None or not level.enabled else f"{rank[0]}/{rank[1]} free",
                _rank(rank),
                now.fallback(level.name) if level.enabled else "",
            )
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

"""The first tab: what to try first, the state of the target, pushes, and options of the 3D view."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from app.html.palette import BAD, BOUND, GOOD, RGB, TARGET, ink
from app.html.text import block, esc, joint_labels, joints_named, quantity, suggestion, swatch
from app.link.messages import TaskView
from app.panels.widgets.command import add_command, on_click
from app.panels.widgets.controls import add_dark_switch, in_colours_of_axes
from app.tab.context import PageContext, SessionSnapshot
from app.view.drag import Reachability
from app.view.targets import draggable
from himpc.stack import Level
from lessons.events import Push, Set
from lessons.settings.torque import TorqueSettings
from robots.inertia import sensible_payload

_DIRECTIONS = {
    "+x": (1, 0, 0),
    "−x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "−y": (0, -1, 0),
    "+z": (0, 0, 1),
    "−z": (0, 0, -1),
}
PUSH_SECONDS = 0.1
_LARGEST_LOAD = 3.0  # kg
_PUSH_PER_KG = 10.0  # N/kg
_DROP = "Drop the payload"


def guide(
    tasks: tuple[TaskView, ...], levels: Sequence[Level], colours: Mapping[str, RGB], dragged: bool
) -> str:
    """Returns HTML that suggests what to try next, with the present names and places of the levels.

    Args:
        tasks: the tasks of the stack.
        levels: all levels of the stack; disabled levels keep their places.
        colours: the colour of each level.
        dragged: whether the target has been dragged, so that the next suggestion is shown.
    """
    places = {level.name: place for place, level in enumerate(levels, start=1) if level.enabled}
    target = draggable(tasks)
    if target is None:
        return suggestion(*_following(tasks, places))
    return suggestion(*(_next(places) if dragged else _first(target.position, places, colours)))


def _first(position: TaskView, places: Mapping[str, int], colours: Mapping[str, RGB]) -> tuple[str, str]:
    ball = f"The arrows are at the {swatch(TARGET)}ball, the target"
    if position.level not in places:
        return _DRAG, f"{ball}. Its level is switched off: switch it on in <b>Tasks</b>."
    own = places[position.level]
    axes = " and ".join(position.axes) if position.axes != "xyz" else ""
    told = [
        f"{ball}, and the robot follows{f' in {axes}' if axes else ''}: this is "
        f"the task of {swatch(colours.get(position.level, BOUND))}{_name(position.level, own)}."
    ]
    above = {name: place for name, place in places.items() if place < own}
    below = {name: place for name, place in places.items() if place > own}
    if above:
        told.append(f"Above it {'is' if len(above) == 1 else 'are'} {_listed(above)}.")
    if below:
        told.append(
            f"Below it {_listed(below)} {'gets' if len(below) == 1 else 'get'} only the freedom that is left."
        )
    return _DRAG, " ".join(told)


def _following(tasks: tuple[TaskView, ...], places: Mapping[str, int]) -> tuple[str, str]:
    off = (
        "Then switch a level off in the tab <b>Tasks</b>" if places else "Add a level in the tab <b>Tasks</b>"
    )
    rest = f"{off}, or push the robot below, and see which errors grow."
    if any(task.kind == "position" for task in tasks):  # its target follows a curve and cannot be dragged
        return "Watch the hand follow the curve.", rest
    return "Push the robot below.", f"{off}, and see which errors grow."


def _next(places: Mapping[str, int]) -> tuple[str, str]:
    rest = "drag the target out of reach, push the robot below, or let it pick up a mass."
    if len(places) < 2:
        return "Now add a task.", f"Add a level in the tab <b>Tasks</b>, {rest}"
    (top, first), (lower, place), *_ = places.items()
    told = (
        f"Open <b>Tasks</b> (or press {place}) and switch off {_name(lower, place)}: its error may grow. "
        f"Does the error of {_name(top, first)} change? Then {rest}"
    )
    return "Now switch a level off.", told


_DRAG = "Drag the target by its arrows."


def _name(level: str, place: int) -> str:
    return f"<b>{esc(spoken(level))}</b> (level {place})"


def _listed(places: Mapping[str, int]) -> str:
    return " and ".join(_name(level, place) for level, place in places.items())


def spoken(level: str) -> str:
    """Returns the name of a level as words."""
    return joints_named(level).replace("+", " and ").replace("_", " ")


class StartPanel:
    """The controls of the first tab, and a guide that depends on what the learner has already done."""

    def __init__(self, page: PageContext, recall: Callable[[], object]) -> None:
        """recall: brings the target to the hand."""
        gui, ready, self._page = page.gui, page.ready, page
        self._guide = gui.add_html(guide(ready.tasks, page.settings.levels, page.colours, dragged=False))
        drags = draggable(ready.tasks) is not None
        self._where = gui.add_html("", visible=drags)
        with gui.add_folder("Target", visible=drags):
            self.clamp = gui.add_checkbox(
                "Keep within reach",
                True,
                hint="On: the controller gets the nearest point that the robot can reach. "
                "Off: the controller gets your point unchanged, and you see how a singular arm moves.",
            )
            on_click(gui.add_button("Bring the target to the hand"), recall)
        with gui.add_folder("Push the robot"):
            robot, names = ready.robot, ready.robot.joint_names
            self._kg = sensible_payload(
                robot.model, robot.frame_id(robot.tip), robot.home, robot.tau_limit, _LARGEST_LOAD
            )
            self._pick_up = f"Pick up {f'{self._kg:g} kg' if self._kg >= 1.0 else f'{1e3 * self._kg:g} g'}"
            step = float(f"{_PUSH_PER_KG * self._kg / 6.0:.1g}")
            bodies = dict(zip(joint_labels(names), names, strict=True))
            body = gui.add_dropdown("Joint", tuple(bodies), initial_value=tuple(bodies)[-1])
            force = gui.add_slider(
                "Force [N]",
                min=step,
                max=round(20.0 * step, 6),
                step=step,
                initial_value=round(6.0 * step, 6),
            )
            buttons = gui.add_button_group(
                "Push",
                tuple(_DIRECTIONS),
                hint=f"Along the target's arrow of this colour, or against it, for {PUSH_SECONDS:g} s",
            )
            gui.add_html(in_colours_of_axes(buttons))
            self.pull = gui.add_checkbox(
                "Pull by hand",
                False,
                hint="Drag any link with the mouse: the force grows with the distance, as with a rubber "
                "band. Key G. While this is on, you cannot drag the target through a link in front of it.",
            )
            self._load = gui.add_button(self._pick_up, hint="The controller does not know about the payload")
        with gui.add_folder("Show", expand_by_default=False):
            self.trace = gui.add_checkbox("Trace of the hand", True)
            self.prediction = gui.add_checkbox("Predicted path", True)
            self.frames = gui.add_checkbox("Target and actual frames", True)
            self.ellipsoids = gui.add_checkbox(
                "Manipulability ellipsoids",
                False,
                hint="The speed at which each level can move its frame if the joints have unit speed. "
                "A level uses only the freedom that the levels above leave. The ellipsoid is flat in "
                "directions without motion",
            )
            self.cover = gui.add_checkbox(
                "Capsules for distances",
                False,
                hint="The capsules that contain the links. A controller that keeps distances measures them "
                "between these capsules, which are a few millimetres thicker than the links",
            )
        add_dark_switch(page)

        @buttons.on_click
        async def _(_: object) -> None:
            direction = np.array(_DIRECTIONS[str(buttons.value)], float)
            vector = tuple(float(x) for x in force.value * direction)
            page.post(Push(bodies[str(body.value)], vector, (0.0, 0.0, 0.0), PUSH_SECONDS))

        add_command(gui, "Turn pulling links by hand on or off", "G", self._grab)

        @self._load.on_click
        async def _(_: object) -> None:
            page.post(Set("plant.payload_kg", 0.0 if self._load.label == _DROP else self._kg))

    def _grab(self) -> None:
        self.pull.value = not self.pull.value

    def show_verdict(self, verdict: Reachability | None, clamped: bool) -> None:
        """Shows a sentence about the state of the target."""
        if verdict is None:
            self._where.content = block("The target is where the hand is.")
            return
        colour = ink(GOOD if verdict.reachable else BAD)
        if verdict.reachable:
            text = "Target within reach."
        elif verdict.fault:
            text = f"Whether the robot can reach this target could not be checked ({verdict.fault}). " + (
                "The robot gets no new position: drag again, or switch off Keep within reach."
                if clamped
                else "The controller gets your point unchanged."
            )
        else:
            text = f"Out of reach by {quantity(verdict.missing, 'm')}. " + (
                "The controller gets the nearest point instead (the ball without arrows)."
                if clamped
                else "The controller gets your point unchanged."
            )
        if verdict.rotation_error > 0:
            text += " The robot cannot have this orientation there: the lower level keeps an error."
        self._where.content = block(f'<b style="color:{colour}">●</b> {esc(text)}')

    def update(self, now: SessionSnapshot[TorqueSettings]) -> None:
        """Updates the names of the levels in the guide, and the label of the button."""
        tasks, levels = now.ready.tasks, now.settings.levels
        self._guide.content = guide(tasks, levels, self._page.colours, self._page.dragged)
        self._load.label = _DROP if now.settings.plant.payload_kg > 0 else self._pick_up

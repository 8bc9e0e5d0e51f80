"""Sliders for joint-space targets: such a target has no place in the 3D view, so each joint has a slider."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import viser
from numpy.typing import NDArray

from app.client.pending_edit import PendingEdit
from app.panels.widgets.mirror import Bindings
from himpc.stack import Level
from himpc.tasks import Joints, Posture
from lessons.events import MoveTarget
from robots import Robot
from robots.truth import joint_axis

Targets = Mapping[str, NDArray[np.float64]]
"""The raw targets that can be moved, by task."""

_TURN, _WAY = np.pi, 2.0
"""Range of a slider on both sides of zero for a joint without limits, rad and m."""


def add_joint_targets(
    gui: viser.GuiApi,
    bindings: Bindings[Targets],
    level: Level,
    robot: Robot,
    targets: Callable[[], Targets],
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
                label = joint if len(tasks) == 1 else f"{task.name}: {joint}"
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
        ("m", 1.0, 0.001, _WAY) if joint_axis(robot.model, at + 1)[0] else ("°", np.degrees(1.0), 0.1, _TURN)
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

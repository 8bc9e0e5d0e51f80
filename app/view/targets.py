"""What a user drags in the 3D view: arrows or rings, the line to them, the same target moved by keys, and the
targets of all tasks that `app.view.drag.Hand` does not handle."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import viser
import viser.transforms as vtf

from app.html.palette import BOUND, RGB
from app.link.messages import Ready, TaskView
from app.tab.context import PageContext
from app.tab.mirror import HOLD, Send
from app.view.robot import gizmo_size, target_radius
from app.view.trails import NOTHING
from lessons.events import MoveTarget
from robots import Robot


def in_order(ready: Ready) -> list[TaskView]:
    return list({task.level: task for task in ready.tasks}.values())


class HandTarget(NamedTuple):
    """The first position target of a stack, and an orientation target of the same frame."""

    position: TaskView
    orientation: TaskView | None


def draggable(tasks: tuple[TaskView, ...]) -> HandTarget | None:
    """Returns the target that `app.view.drag.Hand` handles, if there is one."""
    moved = [task for task in tasks if task.raw is not None]
    position = next((task for task in moved if task.kind == "position"), None)
    if position is None:
        return None
    turned = (task for task in moved if task.kind == "orientation" and task.frame == position.frame)
    return HandTarget(position, next(turned, None))


def raw(task: TaskView) -> np.ndarray:
    assert task.raw is not None
    return task.raw


def full(task: TaskView, values: np.ndarray | None, else_: np.ndarray) -> np.ndarray:
    """Returns the point `else_` with `values` as its controlled coordinates. Values from before a change of
    the task's axes have another number of coordinates and are ignored."""
    point = np.array(else_, float)
    if values is not None and values.shape == (len(task.axes),):
        point[["xyz".index(axis) for axis in task.axes]] = values
    return point


def of_task(task: TaskView, targets: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Returns the position or rotation of a draggable task's target; None if there is no target. None also if
    the target has other coordinates, after a change of the task's axes, its kind or the stack."""
    found = targets.get(task.name)
    return None if found is None or found.shape != raw(task).shape else found


def xyzw(rotation: np.ndarray) -> tuple[float, ...]:
    w, x, y, z = vtf.SO3.from_matrix(rotation).wxyz
    return float(x), float(y), float(z), float(w)


_DISC = 0.09  # m
OPACITY = 0.5
_STILL = 1e-4  # m, and the same number of rad
_TURNING = ("orientation", "relative_orientation")
_POINTS = ("position", "com", "pointing", "relative_position")
_SHOWN = (*_TURNING, *_POINTS, "plane_distance")


class Handle:
    """Arrows along the world's axes, or rings. The user's drag has priority: while `held`, a view does not
    move the handle."""

    def __init__(
        self, scene: viser.SceneApi, node: str, axes: str, size: float, rings: bool = False, **given: Any
    ) -> None:
        """size: of the arrows or rings, m; given: further attributes of the control."""
        x, y, z = self._active = [axis in axes for axis in "xyz"]
        look = {"disable_axes": rings, "disable_sliders": rings, "disable_rotations": not rings}
        self._touched = -float("inf")
        self._moved: Callable[[], object] = lambda: None
        self.control = scene.add_transform_controls(
            node, scale=size, active_axes=(x, y, z), depth_test=False, **{"line_width": 3.0, **look, **given}
        )

    def listen(self, moved: Callable[[], object]) -> None:
        """Lets `moved` be called after each move. The owner calls this when all that `moved` needs is there:
        the browser draws the handle before that, and its moves arrive on viser's loop."""
        self._moved = moved

        @self.control.on_update
        async def _(_: viser.TransformControlsEvent) -> None:
            self._drag()

    def _drag(self) -> None:
        self._touched = time.monotonic()
        self._moved()

    @property
    def position(self) -> np.ndarray:
        return np.array(self.control.position, float)

    @property
    def rotation(self) -> np.ndarray:
        return vtf.SO3(np.array(self.control.wxyz, float)).as_matrix()

    @property
    def held(self) -> bool:
        """Whether the handle was moved a moment ago: the session may not have answered yet."""
        return time.monotonic() - self._touched < HOLD

    def move_to(self, position: np.ndarray) -> None:
        """Moves the handle as a drag does, along the directions of its arrows."""
        self.control.position = np.where(self._active, position, self.position)
        self._drag()

    def turn_by(self, by: np.ndarray) -> None:
        """Turns the handle as a drag of its rings does, about the world's axes by a rotation vector (3,),
        rad."""
        self.control.wxyz = wxyz(vtf.SO3.exp(by).as_matrix() @ self.rotation)
        self._drag()


class Gap:
    """The line from a controlled point to its target; shorter lines than `least`, m, are not drawn."""

    def __init__(
        self, scene: viser.SceneApi, node: str, colour: RGB, thickness: float, least: float = 0.0
    ) -> None:
        self._line = scene.add_line_segments(node, NOTHING, colour, thickness=thickness, visible=False)
        self._least = least

    def show(self, point: np.ndarray, target: np.ndarray) -> None:
        """Draws the line between two points (3,), m."""
        ends = np.array([[point, target]], np.float32)
        self._line.visible = bool(np.linalg.norm(target - point) > self._least)
        if self._line.visible and not np.allclose(ends, self._line.points, rtol=0.0, atol=1e-3):
            self._line.points = ends

    def remove(self) -> None:
        self._line.remove()


@dataclass(frozen=True)
class Movable:
    """A target that code moves on viser's loop, with the same effect as a drag of its arrows or rings.

    Attributes:
        name: the name of its task or role.
        place: returns its present position (3,), m; None while it has no position.
        move: moves it to a position (3,), m; None: it can only be turned.
        turn: turns it about the world's axes by a rotation vector (3,), rad; None: it can only be moved.
    """

    name: str
    place: Callable[[], np.ndarray | None]
    move: Callable[[np.ndarray], None] | None = None
    turn: Callable[[np.ndarray], None] | None = None


class Targets:
    """One target for every task in Cartesian space that has no gizmo of `Hand`."""

    def __init__(self, page: PageContext, tasks: tuple[TaskView, ...], post: Send) -> None:
        of_hand = {task.name for task in draggable(tasks) or () if task is not None}
        self._targets = [
            _Target(page, task, post)
            for task in tasks
            if task.raw is not None and task.kind in _SHOWN and task.name not in of_hand
        ]

    def follow(self, poses: np.ndarray, raw: dict[str, np.ndarray], live: bool) -> None:
        """poses (J, 7) of the instant that is shown; raw: the session's raw targets; live: whether this
        instant is now, so that targets can be dragged."""
        for target in self._targets:
            target.follow(poses, of_task(target.task, raw), live)

    def movables(self) -> list[Movable]:
        """Returns the targets, which can be moved without a mouse."""
        return [target.movable for target in self._targets]

    def remove(self) -> None:
        """Removes the targets from the scene."""
        for target in self._targets:
            target.remove()


class _Target:
    """Arrows or rings, a mark, and a label."""

    def __init__(self, page: PageContext, task: TaskView, post: Send) -> None:
        scene, robot, size = page.client.scene, page.robot, 0.75 * gizmo_size(page.robot)
        self.task, self._robot = task, robot
        self._home = np.array(pin.centerOfMass(robot.model, robot.model.createData(), robot.home))
        node, radius = f"/targets/{task.name}", target_radius(robot)
        colour = page.colours.get(task.level, BOUND)
        self._base = scene.add_frame(node, show_axes=False)
        turning, flat = task.kind in _TURNING, task.kind == "plane_distance"
        along = "xyz" if task.kind == "pointing" else "x" if flat else task.axes
        self._handle = Handle(scene, f"{node}/control", along, size, rings=turning)
        self._control = self._handle.control
        mark = f"{node}/control/mark"
        if flat:
            scene.add_box(mark, color=colour, dimensions=(0.006, _DISC, _DISC), opacity=OPACITY)
        elif not turning:
            scene.add_icosphere(mark, radius=radius, color=colour, opacity=OPACITY)
        above = (0.65 if turning or "z" not in along else 1.0) * size + 0.04
        scene.add_label(
            f"{node}/control/label", task.name, position=(0.0, 0.0, above), anchor="bottom-center"
        )
        self._gap = Gap(scene, f"/gaps/{task.name}", colour, 0.005, radius)
        move = None if turning else self._put if flat else self._handle.move_to
        turn = self._handle.turn_by if turning else None
        self.movable = Movable(task.name, self._at, move, turn)
        self.follow(page.poses_or_still(), task.raw, True)
        self._handle.listen(lambda: post(MoveTarget(task.name, self._value())))

    def _at(self) -> np.ndarray | None:
        return self._handle.position if self._control.visible else None

    def _put(self, position: np.ndarray) -> None:
        self._control.position = position  # the arrow of a plane is not along an axis of the world
        self._handle.move_to(position)

    def _value(self) -> tuple[float, ...]:
        """Returns the task's target at the dragged position."""
        task, at = self.task, self._handle.position
        if task.kind in _TURNING:
            return xyzw(self._handle.rotation)
        if task.kind == "plane_distance":
            return (float(np.array(task.normal) @ at - task.offset),)
        axes = "xyz" if task.kind == "pointing" else task.axes
        return tuple(float(at["xyz".index(axis)]) for axis in axes)

    def follow(self, poses: np.ndarray, raw: np.ndarray | None, live: bool) -> None:
        task = self.task
        frame = frame_pose(self._robot, poses, task.frame)
        base = pin.SE3.Identity()
        if task.kind.startswith("relative"):
            base = frame_pose(self._robot, poses, task.root)
        self._control.visible = live and raw is not None
        put(self._base, base.translation, base.rotation)
        if raw is None or self._handle.held:
            return
        here = base.actInv(frame)
        if task.kind in _TURNING:
            put(self._control, here.translation, raw)
        elif task.kind == "plane_distance":
            normal = np.array(task.normal)
            above = float(normal @ frame.translation - task.offset - raw[0])
            put(self._control, frame.translation - above * normal, _facing(normal))
        else:
            else_ = self._home if task.kind == "com" else here.translation
            at = raw if task.kind == "pointing" else full(task, raw, else_)
            put(self._control, at, np.eye(3))
            if task.kind != "com":
                self._gap.show(frame.translation, base.act(at))

    def remove(self) -> None:
        self._base.remove()
        self._gap.remove()


def frame_pose(robot: Robot, poses: np.ndarray, frame: str) -> pin.SE3:
    """Returns the pose of a link in the world, from the poses (J, 7) of the joints."""
    found = robot.model.frames[robot.frame_id(frame)]
    joint = found.parentJoint
    if joint == 0:
        return found.placement
    pose = poses[joint - 1]
    return pin.SE3(vtf.SO3(pose[3:]).as_matrix(), pose[:3]) * found.placement


def put(
    node: viser.SceneNodeHandle, position: np.ndarray | tuple[float, ...], rotation: np.ndarray | None = None
) -> None:
    """Sets a node's position (3,), m, and rotation (3, 3), each only if it has changed. An unchanged value
    would make the browser redraw without need."""
    if np.abs(np.array(node.position) - position).max() > _STILL:
        node.position = np.asarray(position, float)
    if rotation is None:
        return
    turned = wxyz(rotation)
    if min(np.abs(node.wxyz - turned).max(), np.abs(node.wxyz + turned).max()) > _STILL:
        node.wxyz = turned


def wxyz(rotation: np.ndarray) -> np.ndarray:
    return vtf.SO3.from_matrix(rotation).wxyz


def _facing(normal: np.ndarray) -> np.ndarray:
    """Returns a rotation whose x axis is the given normal."""
    return pin.Quaternion.FromTwoVectors(np.array([1.0, 0.0, 0.0]), normal).toRotationMatrix()

"""The targets of all tasks that `Hand` does not handle: a draggable object for each."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import viser
import viser.transforms as vtf

from app.client.pending_edit import Send
from app.html.palette import BOUND, RGB
from app.link.messages import Ready, TaskView
from app.view.coordinates import draggable, full, of_task, xyzw
from app.view.drag_target import Gap, Handle, Movable, turned
from app.view.robot import target_radius
from lessons.events import MoveTarget
from robots import Robot

_DISC = 0.09  # m
_OPACITY = 0.5
_STILL = 1e-4  # m, and the same number of rad
_TURNING = ("orientation", "relative_orientation")
_POINTS = ("position", "com", "pointing", "relative_position")
_SHOWN = (*_TURNING, *_POINTS, "plane_distance")


class Targets:
    """One target for every task in Cartesian space that has no gizmo of `Hand`."""

    def __init__(
        self,
        scene: viser.SceneApi,
        ready: Ready,
        colours: dict[str, RGB],
        poses: np.ndarray,
        size: float,
        post: Send,
    ) -> None:
        """poses: (J, 7), present poses of joints and tip; size: of the arrows, m."""
        of_hand = {task.name for task in draggable(ready.tasks) if task is not None}
        self._targets = [
            _Target(scene, task, ready.robot, colours.get(task.level, BOUND), poses, size, post)
            for task in ready.tasks
            if task.raw is not None and task.kind in _SHOWN and task.name not in of_hand
        ]

    def follow(self, poses: np.ndarray, raw: dict[str, np.ndarray], live: bool) -> None:
        """poses (J, 7) of the instant that is shown; raw: the session's raw targets; live: whether this
        instant is now, so that targets can be dragged."""
        for target in self._targets:
            target.follow(poses, of_task(target.task, raw), live)

    def movables(self) -> list[Movable]:
        """Returns the targets, which can be moved without a mouse."""
        return [target.movable() for target in self._targets]

    def remove(self) -> None:
        """Removes the targets from the scene."""
        for target in self._targets:
            target.remove()


class _Target:
    """Arrows or rings, a mark, and a label."""

    def __init__(
        self,
        scene: viser.SceneApi,
        task: TaskView,
        robot: Robot,
        colour: RGB,
        poses: np.ndarray,
        size: float,
        post: Send,
    ) -> None:
        self.name, self.task, self._robot, self._post = task.name, task, robot, post
        self._home = np.array(pin.centerOfMass(robot.model, robot.model.createData(), robot.home))
        node, radius = f"/targets/{task.name}", target_radius(robot)
        self._base = scene.add_frame(node, show_axes=False)
        turning, flat = task.kind in _TURNING, task.kind == "plane_distance"
        along = "xyz" if task.kind == "pointing" else "x" if flat else task.axes
        self._handle = Handle(scene, f"{node}/control", along, size, rings=turning)
        self._control = self._handle.control
        mark = f"{node}/control/mark"
        if flat:
            scene.add_box(
                mark, color=colour, dimensions=(0.006, _DISC, _DISC), opacity=_OPACITY, cast_shadow=False
            )
        elif not turning:
            scene.add_icosphere(mark, radius=radius, color=colour, opacity=_OPACITY, cast_shadow=False)
        above = (0.65 if turning or "z" not in along else 1.0) * size + 0.04
        scene.add_label(f"{node}/control/label", task.name, position=(0.0, 0.0, above))
        self._gap = Gap(scene, f"/gaps/{task.name}", colour, 0.005, radius)
        self.follow(poses, task.raw, True)
        self._handle.listen(self._moved)

    def _moved(self) -> None:
        self._handle.touch()
        self._post(MoveTarget(self.name, self._value()))

    def movable(self) -> Movable:
        """Returns the target, which can be moved without a mouse."""
        if self.task.kind in _TURNING:
            return Movable(self.name, self._at, turn=self._turn_by)
        return Movable(self.name, self._at, move=self._put)

    def _at(self) -> np.ndarray | None:
        return np.array(self._control.position, float) if self._control.visible else None

    def _put(self, position: np.ndarray) -> None:
        self._control.position = position
        self._moved()

    def _turn_by(self, by: np.ndarray) -> None:
        rotation = turned(vtf.SO3(np.array(self._control.wxyz, float)).as_matrix(), by)
        self._control.wxyz = vtf.SO3.from_matrix(rotation).wxyz
        self._moved()

    def _value(self) -> tuple[float, ...]:
        """Returns the task's target at the dragged position."""
        task, at = self.task, np.array(self._control.position, float)
        if task.kind in _TURNING:
            return xyzw(vtf.SO3(np.array(self._control.wxyz, float)).as_matrix())
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
        shown = live and raw is not None
        if self._control.visible != shown:
            self._control.visible = shown
        _put(self._base, base.translation, base.rotation)
        if raw is None or self._handle.held:
            return
        here = base.actInv(frame)
        if task.kind in _TURNING:
            _put(self._control, here.translation, raw)
        elif task.kind == "plane_distance":
            normal = np.array(task.normal)
            above = float(normal @ frame.translation - task.offset - raw[0])
            _put(self._control, frame.translation - above * normal, _facing(normal))
        else:
            else_ = self._home if task.kind == "com" else here.translation
            at = raw if task.kind == "pointing" else full(task, raw, else_)
            _put(self._control, at, np.eye(3))
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


def _put(node: viser.SceneNodeHandle, position: np.ndarray, rotation: np.ndarray) -> None:
    """Sets a node's position and rotation, each only if it has changed. An unchanged value would make the
    browser redraw without need."""
    wxyz = vtf.SO3.from_matrix(rotation).wxyz
    if np.abs(np.array(node.position) - position).max() > _STILL:
        node.position = position
    if min(np.abs(node.wxyz - wxyz).max(), np.abs(node.wxyz + wxyz).max()) > _STILL:
        node.wxyz = wxyz


def _facing(normal: np.ndarray) -> np.ndarray:
    """Returns a rotation whose x axis is the given normal."""
    return pin.Quaternion.FromTwoVectors(np.array([1.0, 0.0, 0.0]), normal).toRotationMatrix()

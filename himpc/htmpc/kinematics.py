"""The task model of section IV-A: the tasks' errors (6) along a prediction, and the kinematics of all joints
at many configurations at once, for trees of revolute and prismatic joints."""

from __future__ import annotations

from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from himpc.htmpc.kernel.kinematics import frame_along
from himpc.kinematics.configuration import Configuration
from himpc.kinematics.geometry import Geometry, geometry
from himpc.references import Preview
from himpc.rotation import exp3
from himpc.tasks import FramePosition, OrientationTask, Task
from himpc.tick.kernel.kinematics import ORIENTATION, POSITION
from himpc.tick.kernel.placements import place_all
from robots import InputError, Robot
from robots.arrays import Array, Indices
from robots.per_robot import per_robot

_TASK = np.array([[POSITION, 0, 0, 3], [ORIENTATION, 0, 3, 3]])
_PART = np.array([0, 1, 2, 0, 1, 2])
"""The three linear and three angular rows of one frame, in the form of the kernel's tasks."""


class Placed(NamedTuple):
    """Placements and axes of all joints at K configurations.

    Attributes:
        at: (K, J, 12), orientation in the world, row by row, then position in m.
        z: (K, J, 3), axis of the joint.
    """

    at: Array
    z: Array


def placed(tree: Geometry, q: Array) -> Placed:
    """Computes the placements of all joints at configurations q (K, n)."""
    q = np.array(q, float)
    joints = len(tree.parent)
    placements = Placed(np.empty((len(q), joints, 12)), np.empty((len(q), joints, 3)))
    place_all(*tree.of_joints, tree.rotation, tree.translation, tree.axis, q, *placements)
    return placements


class Frames(NamedTuple):
    """A frame at K configurations: orientation R (K, 3, 3), position p (K, 3) in m, and Jacobian J (K, 6, n)
    at the frame's origin in world axes, three linear rows before three angular rows."""

    R: Array
    p: Array
    J: Array


def frame_at(robot: Robot, where: Placed, name: str) -> Frames:
    """Returns a frame of the robot for given placements of the joints; an empty name means the tip."""
    tree, K = geometry(robot), len(where.at)
    frames = Frames(np.empty((K, 3, 3)), np.empty((K, 3)), np.empty((K, 6, robot.n)))
    frame_along(_TASK, _PART, *tree.of_joints, *where, *_mounted(robot, name), *frames)
    return frames


@per_robot
def _mounted(robot: Robot, name: str) -> tuple[Indices, Array, Array]:
    """Returns the joint that carries a frame, and the frame's axes and origin in the joint's frame."""
    frame = robot.model.frames[robot.frame_id(name or robot.tip)]
    placement = frame.placement
    joint, origin = np.array([frame.parentJoint], np.intp), np.array([placement.translation])
    return joint, np.ascontiguousarray(placement.rotation), origin


Desired = list[Array] | Array
"""The references r of (6), one for each knot."""


class Knots:
    """Frames and Jacobians at all knots of a prediction, knot 1 first."""

    def __init__(self, robot: Robot, data: pin.Data, q: Array) -> None:
        """q: (K, n) configurations; data: Pinocchio's work space, for tasks that need more than frames."""
        self._robot, self._data, self._q = robot, data, q
        self._frames: dict[str, Frames] = {}

    @cached_property
    def joints(self) -> Placed:
        """The placements of all joints."""
        return placed(geometry(self._robot), self._q)

    def errors(self, task: Task, desired: Desired) -> Array:
        """Returns e = x − r of (6) at every knot, (K, m)."""
        if isinstance(task, FramePosition):
            return self._frame(task.frame).p[:, task.components] - np.asarray(desired)
        pairs = zip(self._knots, desired, strict=True)
        return np.array([task.error(task.value(knot), goal) for knot, goal in pairs])

    def value(self, task: Task) -> Array:
        """Returns x at the first knot."""
        if isinstance(task, FramePosition):
            return self._frame(task.frame).p[0, task.components]
        return task.value(self._knots[0])

    def jacobian(self, task: Task, desired: Desired) -> Array:
        """Returns J of a task at every knot, (K, m, n), for the reference r = `desired`."""
        if isinstance(task, FramePosition):
            return self._frame(task.frame).J[:, :3][:, task.components]
        if isinstance(task, OrientationTask) and len(task.axes) == 1:
            rotations = [task.value(knot) for knot in self._knots]
            return task.slopes(rotations, list(desired)) @ task.angular_jacobian(self._path)
        return task.jacobian(self._path)

    def _frame(self, name: str) -> Frames:
        frames = self._frames.get(name)
        if frames is None:
            frames = self._frames[name] = frame_at(self._robot, self.joints, name)
        return frames

    @cached_property
    def _path(self) -> Configuration:
        """All knots as one `Configuration`, used for Jacobians only."""
        robot, data, q = self._robot, self._data, self._q
        return Configuration(robot, data, q[0], q[0], q[1:], jacobians=lambda frame: self._frame(frame).J)

    @cached_property
    def _knots(self) -> list[Configuration]:
        """One `Configuration` per knot, used for positions only."""
        every = enumerate(self._q)
        return [
            Configuration(self._robot, self._data, q, q, placed=partial(self._placement, k)) for k, q in every
        ]

    def _placement(self, knot: int, frame: str) -> pin.SE3:
        frames = self._frame(frame)
        return pin.SE3(frames.R[knot], frames.p[knot])


def desired_values(task: Task, preview: Preview, N: int) -> Desired:
    """Returns r of (6) at knots 0 … N.

    Raises:
        InputError: the preview does not have N + 1 samples.
    """
    if len(preview.displacement) != N + 1:
        raise InputError(
            f"the preview of task '{task.name}' has {len(preview.displacement)} samples, not {N + 1}: knots "
            f"0 to {N} are needed, as `previews(references, t, dt, {N})` returns them"
        )
    if preview.value.ndim == 1:
        return preview.value + preview.displacement
    turn = task.spread(preview.displacement) if isinstance(task, OrientationTask) else preview.displacement
    return [exp3(vector) @ preview.value for vector in turn]

"""Forward kinematics of all joints at many configurations at once, for trees of revolute and prismatic
joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.kernel.kinematics import frame_along
from himpc.kinematics.geometry import Geometry, geometry
from himpc.tick.kernel.kinematics import ORIENTATION, POSITION
from himpc.tick.kernel.placements import place_all
from robots import Robot
from robots.per_robot import per_robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

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

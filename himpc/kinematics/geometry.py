"""The tree of joints of a robot as arrays: geometry without masses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robots import Robot
from robots.per_robot import per_robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class Geometry(NamedTuple):
    """A robot's tree; row j belongs to joint j, row 0 to the world.

    Attributes:
        parent: (n+1,) index of the parent joint, which is always smaller.
        rotation, translation: (n+1, 3, 3) and (n+1, 3) m, from the parent joint to this one at q = 0.
        axis: (n+1, 3) in the joint's own axes.
        is_revolute: (n+1,) 1 for a revolute joint, 0 for a prismatic one.
        moves: (n+1, n) 1 where the joint of the column moves joint j.
    """

    parent: Indices
    rotation: Array
    translation: Array
    axis: Array
    is_revolute: Indices
    moves: Array


@per_robot
def geometry(robot: Robot) -> Geometry:
    """Returns the tables of a robot."""
    model, n = robot.model, robot.n
    data = model.createData()
    # The motion from q = 0 to q = 1 rad or m shows the axis of every kind of joint.
    pin.forwardKinematics(model, data, np.ones(n))
    axis, is_revolute, moves = np.zeros((n + 1, 3)), np.zeros(n + 1, np.intp), np.zeros((n + 1, n))
    for joint in range(1, n + 1):
        motion = model.jointPlacements[joint].actInv(data.liMi[joint])
        turning = pin.log3(motion.rotation)
        is_revolute[joint] = int(float(np.linalg.norm(turning)) > 0.5)
        axis[joint] = turning if is_revolute[joint] else motion.translation
        axis[joint] /= np.linalg.norm(axis[joint])
        moves[joint, [other - 1 for other in model.supports[joint] if other > 0]] = 1.0
    return Geometry(
        np.array([int(parent) for parent in model.parents], np.intp),
        np.array([placement.rotation for placement in model.jointPlacements]),
        np.array([placement.translation for placement in model.jointPlacements]),
        axis,
        is_revolute,
        moves,
    )

"""The tree of joints of a robot as arrays: geometry without masses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from robots import Robot
from robots.arrays import Array, Indices
from robots.joints import joint_axis, joints_at_zero, motions
from robots.per_robot import per_robot


class Geometry(NamedTuple):
    """A robot's tree; row j belongs to joint j, row 0 to the world. J − 1 joints move with n coordinates.

    Attributes:
        parent: (J,) index of the parent joint, which is always smaller.
        rotation, translation: (J, 3, 3) and (J, 3) m, from the parent joint to this one at q = 0.
        axis: (J, 3) in the joint's own axes.
        is_revolute: (J,) 1 for a revolute joint, 0 for a prismatic one.
        column, factor: (J,) the joint moves by factor · q[column]; the factor is 1 unless the joint follows
            another one.
        carries: (J, J) 1 where the joint of the column carries joint j, or is this joint.
        moves: (J, n) 1 where the coordinate of the column moves joint j.
    """

    parent: Indices
    rotation: Array
    translation: Array
    axis: Array
    is_revolute: Indices
    column: Indices
    factor: Array
    carries: Array
    moves: Array

    @property
    def of_joints(self) -> tuple[Indices, Indices, Indices, Array]:
        """Parents, kinds, columns and factors of the joints, in the order of compiled functions."""
        return self.parent, self.is_revolute, self.column, self.factor


@per_robot
def geometry(robot: Robot) -> Geometry:
    """Returns the tables of a robot."""
    model, J = robot.model, robot.model.njoints
    column, factor = motions(model)
    placements = joints_at_zero(model)
    axis, is_revolute = np.zeros((J, 3)), np.zeros(J, np.intp)
    carries, moves = np.zeros((J, J)), np.zeros((J, robot.n))
    data = model.createData()
    # The motion from q = 0 to q = 1 rad or m shows the axis of every kind of joint.
    pin.forwardKinematics(model, data, np.ones(robot.n))
    for joint in range(1, J):
        if joint in robot.joints:
            motion = placements[joint].actInv(data.liMi[joint])
            turning = pin.log3(motion.rotation)
            is_revolute[joint] = int(float(np.linalg.norm(turning)) > 0.5)
            axis[joint] = turning if is_revolute[joint] else motion.translation
            axis[joint] /= np.linalg.norm(axis[joint])
        else:
            prismatic, axis[joint] = joint_axis(model, joint)
            is_revolute[joint] = int(not prismatic)
        for carrier in model.supports[joint]:
            if carrier > 0:
                carries[joint, carrier] = moves[joint, column[carrier]] = 1.0
    return Geometry(
        np.array([int(parent) for parent in model.parents], np.intp),
        np.array([placement.rotation for placement in placements]),
        np.array([placement.translation for placement in placements]),
        axis,
        is_revolute,
        column,
        factor,
        carries,
        moves,
    )

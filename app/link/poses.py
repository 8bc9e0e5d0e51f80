"""The poses of a robot's links, for its picture."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from robots import Robot

_WXYZ = [0, 1, 2, 6, 3, 4, 5]


class LinkPoses:
    """Computes the poses of all joints and the tip: (J, 7), position in m and quaternion wxyz."""

    def __init__(self, robot: Robot) -> None:
        self._model = robot.model
        self._data = robot.model.createData()
        self._tip = robot.frame_id(robot.tip)
        self._poses = np.zeros((robot.model.njoints, 7))

    def at(self, q: np.ndarray) -> np.ndarray | None:
        """Returns the poses at joint positions q, in a buffer that the next call overwrites; None if q is not
        finite."""
        if not np.isfinite(q).all():
            return None
        pin.framesForwardKinematics(self._model, self._data, q)
        for joint in range(1, self._model.njoints):
            self._poses[joint - 1] = _pose(self._data.oMi[joint])
        self._poses[-1] = _pose(self._data.oMf[self._tip])
        return self._poses


def _pose(placement: pin.SE3) -> np.ndarray:
    return pin.SE3ToXYZQUAT(placement)[_WXYZ]

"""The shared memory for a session's telemetry: rows of its width, and the poses of its links."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from app.link.ring import Block
from lessons.session.session import Session
from robots import Robot

_WXYZ = [0, 1, 2, 6, 3, 4, 5]


class LinkPoses:
    """Computes the poses of joints 1 … n and the tip: (n + 1, 7), position in m and quaternion wxyz."""

    def __init__(self, robot: Robot) -> None:
        self._model = robot.model
        self._data = robot.model.createData()
        self._tip = robot.frame_id(robot.tip)
        self._poses = np.zeros((robot.n + 1, 7))

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


class Outlet:
    """The memory of one robot under one stack.

    Attributes:
        block: the shared memory.
        poses: computes the poses that are written into the memory.
        layout: the layout of the rows.
        step_us, late: the indices of these columns; None if a row has no such column.
        told: whether the page has received the handle of this memory.
    """

    def __init__(self, session: Session, told: bool = True) -> None:
        """Raises InputError if there is not enough memory."""
        self.told = told
        self.poses, self.layout = LinkPoses(session.robot), session.layout
        self.block = Block.for_robot(session.robot, session.layout.size)
        fields = session.layout.fields
        self.step_us = fields["step_us"].start
        self.late = fields["late"].start if "late" in fields else None

    def fits(self, session: Session) -> bool:
        """Returns whether the session's rows still have this layout. Each stack has its own layout."""
        if session.layout is not self.layout and session.layout == self.layout:
            self.layout = session.layout
        return session.layout is self.layout

    def write_poses(self, session: Session) -> None:
        """Writes the true poses of the plant's links, for the 3D view."""
        poses = self.poses.at(np.asarray(session.plant.q))
        if poses is not None:
            self.block.write_poses(poses, session.t)

"""The shared memory for a session's telemetry: rows of its width, and the poses of its links."""

from __future__ import annotations

import numpy as np

from app.link.poses import LinkPoses
from app.link.ring import Block
from lessons.session.session import Session


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

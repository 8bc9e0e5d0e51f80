"""What the simulation process tells the page of a session, whatever its kind."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from app.link.inside import Inside, InsideRequest
from app.link.messages import BindingRow, TaskView
from app.link.mission_view import MissionView
from app.link.own_code import OwnCode

LISTED = 24
"""Binding rows sent to the page: more cannot be read in a tenth of a second."""


class SessionReport(ABC):
    """What there is to see of a session.

    watch: what the page wants to see of its inside.
    """

    def __init__(self, session: Any) -> None:
        """session: of the kind that the subclass is for."""
        self.session = session
        self.watch = InsideRequest()

    def own(self) -> OwnCode | None:
        """Of a controller from a file: whether it runs; what was saved meanwhile takes over."""
        return None

    @abstractmethod
    def tasks(self) -> tuple[TaskView, ...]:
        """What the page must know of the tasks."""

    @abstractmethod
    def targets(self) -> dict[str, np.ndarray]:
        """Where the hand put the draggable targets, by task."""

    @abstractmethod
    def path(self) -> np.ndarray:
        """The predicted path of the tip, (N + 1, 3) m; empty before the first tick."""

    def room(self) -> np.ndarray:
        """Points (k, 3) that the camera should show besides the robot, m."""
        return np.zeros((0, 3))

    def binding(self) -> tuple[BindingRow, ...]:
        """Active constraints of the last plan, at most LISTED."""
        return tuple(BindingRow(*row) for row in self.session.binding()[:LISTED])

    def gauge(self) -> tuple[float, float] | None:
        """Norm and spectral radius of I − M⁻¹M̄, where the controller has an M̄."""
        return None

    def ranks(self) -> dict[str, tuple[int, int]]:
        """Per level the directions it gets where the robot is, and its rows, where there is a stack."""
        return {}

    def mission(self) -> MissionView | None:
        """How far the mission is, where there is one."""
        return None

    def inside(self) -> Inside | None:
        """What `watch` asks for of the inside of the last tick; None where it asks for nothing, or there is
        no such thing."""
        return None

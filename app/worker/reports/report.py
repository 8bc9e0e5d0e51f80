"""What the simulation process asks of a session, whatever its kind."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from app.link.messages import BindingRow, MissionView, TaskView
from lessons.kinds import AnyEvent, AnySession

LISTED = 24
"""Binding rows sent to the page: more cannot be read in a tenth of a second."""


class Run(Protocol):
    """A session in steps small enough to move smoothly, and what the page is told of it."""

    @property
    def session(self) -> AnySession:
        """The session itself."""
        ...

    @property
    def step_s(self) -> float:
        """Simulated time of the next `advance`, s."""
        ...

    @property
    def between(self) -> bool:
        """Whether a control period has begun and is not over."""
        ...

    def post(self, event: AnyEvent) -> None:
        """An event for the mailbox; one that the session does not know leaves a notice."""
        ...

    def advance(self) -> np.ndarray | None:
        """One step; the row of telemetry if a control period ended with it."""
        ...

    def tasks(self) -> tuple[TaskView, ...]:
        """What the page must know of the tasks."""
        ...

    def targets(self) -> dict[str, np.ndarray]:
        """Where the hand put the draggable targets, by task."""
        ...

    def path(self) -> np.ndarray:
        """The predicted path of the tip, (N + 1, 3) m; empty before the first tick."""
        ...

    def room(self) -> np.ndarray:
        """Points (k, 3) that the camera should show besides the robot, m."""
        ...

    def binding(self) -> tuple[BindingRow, ...]:
        """Active constraints of the last plan, at most LISTED."""
        ...

    def gauge(self) -> tuple[float, float] | None:
        """Norm and spectral radius of I − M⁻¹M̄, where the controller has an M̄."""
        ...

    def mission(self) -> MissionView | None:
        """How far the mission is, where there is one."""
        ...

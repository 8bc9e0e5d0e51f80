"""The reports of the simulation process about a session of either level."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from app.link.messages import InsideRequest, TaskView
from himpc.plan import Binding
from himpc.tasks import PlaneDistance, Task
from himpc.tasks.kinds import kind_name
from robots.world import World

LISTED = 24
"""Largest number of active constraints sent to the page. Nobody can read more in a tenth of a second."""


class SessionReport(ABC):
    """The data of a session that the page shows.

    watch: the internal data that the page requests.
    """

    def __init__(self, session: Any) -> None:
        """session: a session of the kind that the subclass handles."""
        self.session = session
        self.watch = InsideRequest()

    def extras(self, running: bool, ran: bool) -> dict[str, Any]:
        """Returns the fields of `Status` that only one level has. running: whether simulated time passes;
        ran: whether there was a tick since the start. Code that was saved since the last call takes
        effect."""
        return {}

    def tasks(self) -> tuple[TaskView, ...]:
        """Returns the data of the tasks that the page needs."""
        targets = self.targets()
        return tuple(
            self._view(task, level.name, targets.get(task.name))
            for level in self.session.settings.levels
            for task in level.tasks
        )

    def _view(self, task: Task, level: str, raw: np.ndarray | None) -> TaskView:
        robot = self.session.robot
        return TaskView(
            name=task.name,
            level=level,
            kind=kind_name(task),
            unit=task.unit,
            frame=str(getattr(task, "frame", "")) or robot.tip,
            axes=str(getattr(task, "axes", "")),
            root=str(getattr(task, "root", "")) or robot.frames[0],
            normal=tuple(task.n.tolist()) if isinstance(task, PlaneDistance) else (0.0, 0.0, 1.0),
            offset=task.offset if isinstance(task, PlaneDistance) else 0.0,
            raw=raw,
            path=self.session.reference_path(task.name),
        )

    @abstractmethod
    def targets(self) -> dict[str, np.ndarray]:
        """Returns the raw targets that can be dragged, by task."""

    @abstractmethod
    def path(self) -> np.ndarray:
        """Returns the predicted path of the tip, (N + 1, 3) m; empty before the first tick."""

    def room(self) -> np.ndarray:
        """Points (k, 3), m, that the camera should show besides the robot."""
        return np.zeros((0, 3))

    def binding(self) -> tuple[Binding, ...]:
        """Returns active constraints of the last plan, at most LISTED."""
        return tuple(self.session.binding()[:LISTED])

    def world(self) -> World:
        """Returns the objects around the robot."""
        return ()

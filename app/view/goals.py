"""The goals in a scene with a mission: one per role, and the events that are posted when a goal is moved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import viser

from app.client.pending_edit import Send
from app.html.palette import RGB
from app.html.text import free_name, quantity
from app.link.messages import Ready, Status, TaskView
from app.link.mission_view import MissionRow
from app.view.goal import Goal
from app.view.movable import Movable
from app.view.targets import Targets
from lessons.events import Event, InsertTask, MoveTarget

_THERE = 5e-3
"""Distance, m, below which a point has reached its goal."""


def point(values: Sequence[float] | np.ndarray) -> np.ndarray:
    """Returns a point in space from the coordinates of a hand (3) or of a base on the floor (2), m."""
    return np.array([*values, 0.0][:3], float)


def open_row(rows: Sequence[MissionRow], role: str) -> MissionRow | None:
    """Returns the first task of a role that is not completed."""
    return next((row for row in rows if row.role == role and row.state != "done"), None)


class Goals:
    """One goal for each position role, and rings at the robot's hand for each orientation role. A goal on a
    predefined trajectory cannot be dragged and shows the present reference of its point."""

    def __init__(
        self,
        scene: viser.SceneApi,
        ready: Ready,
        colours: dict[str, RGB],
        poses: np.ndarray,
        size: float,
        post: Send,
        status: Callable[[], Status | None],
        dragged: Callable[[], None],
    ) -> None:
        """poses: (n + 1, 7), present poses of joints and tip; size: of the arrows of a hand, m; status:
        returns the newest report; dragged: called at every move."""
        self._post, self._status, self._dragged = post, status, dragged
        self._roles = {task.name: task for task in ready.tasks if task.kind == "position"}
        self._given = frozenset(name for name, task in self._roles.items() if task.raw is None)
        self._goals = {
            name: Goal(
                scene,
                name,
                task.axes,
                colours[task.level],
                np.zeros(3) if task.raw is None else point(task.raw),
                size if "z" in task.axes else 2 * size,
                None if task.raw is None else lambda place, task=task: self._moved(task, place),
            )
            for name, task in self._roles.items()
        }
        self._asked: dict[str, str] = {}
        turning = tuple(task for task in ready.tasks if task.kind == "orientation")
        self._rings = Targets(scene, replace(ready, tasks=turning), colours, poses, 0.75 * size, self._turned)

    def _moved(self, task: TaskView, place: np.ndarray) -> None:
        """Moves the goal of the role's first open task; if there is no open task, adds a task that holds the
        point there."""
        status = self._status()
        if status is None or status.mission is None:
            return
        self._dragged()
        goal = tuple(float(place["xyz".index(axis)]) for axis in task.axes)
        row, names = open_row(status.mission.rows, task.name), [each.name for each in status.mission.rows]
        asked = self._asked.get(task.name)
        if row is not None:
            self._post(MoveTarget(row.name, goal))
        elif asked is not None and asked not in names:
            self._post(MoveTarget(asked, goal))  # the session has not answered yet
        else:
            name = self._asked[task.name] = free_name(f"{task.name} by hand", names)
            self._post(InsertTask(name, task.name, goal, hold=None))

    def _turned(self, event: Event) -> None:
        """Changes the orientation of the role's open task."""
        status = self._status()
        if status is None or status.mission is None or not isinstance(event, MoveTarget):
            return
        row = open_row(status.mission.rows, event.task)
        if row is not None:
            self._dragged()
            self._post(MoveTarget(row.name, event.value))

    def turn(self, poses: np.ndarray, targets: dict[str, np.ndarray], live: bool) -> None:
        """Moves the rings along with the hand; arguments as for `app.view.targets.Targets.follow`."""
        self._rings.follow(poses, targets, live)

    def follow(self, status: Status, latest: np.ndarray | None, fields: dict[str, slice]) -> None:
        """Updates goals and lines from a new status and the newest row of telemetry."""
        rows = () if status.mission is None else status.mission.rows
        for name, goal in self._goals.items():
            row, target = open_row(rows, name), status.targets.get(name)
            text = f"{name}: done" if row is None else row.name
            at, wanted = (
                (np.full(3, np.nan), np.full(3, np.nan))
                if latest is None
                else (latest[fields[f"x/{name}"]], latest[fields[f"x_d/{name}"]])
            )
            if target is None and name in self._given and np.isfinite(wanted).all():
                target = wanted
            if target is not None and np.isfinite(at).all():
                goal.reach_from(point(at))
                away = float(np.linalg.norm(at - target))
                if away > _THERE:
                    text += f": {quantity(away, 'm')} to go"
            goal.follow(None if target is None else point(target), text)

    def movables(self) -> list[Movable]:
        """Returns the goals, which can be moved without a mouse: positions first, then orientations."""
        free = {name: task for name, task in self._roles.items() if task.raw is not None}
        return [
            *(Movable(name, goal.where, goal.put) for name, goal in self._goals.items() if name in free),
            *self._rings.movables(),
        ]

    @property
    def places(self) -> dict[str, np.ndarray]:
        """The position at which each goal is drawn, (3,) m."""
        return {name: goal.place for name, goal in self._goals.items()}

"""The reports of a velocity-level session. Each step sends one command to the servos."""

from __future__ import annotations

from typing import Any, final

import numpy as np

from app.link.messages import MissionRow, MissionView, Person
from app.worker.report import SessionReport
from himpc.htmpc import base_joints
from himpc.missions import Follow, Go, MissionTask
from himpc.references import Path
from himpc.rotation import quaternion
from himpc.tasks import FramePosition
from lessons.session.velocity import VelocitySession

_ABOVE = np.array([0.0, 0.0, 0.015])
"""Height of predicted paths above the floor, m, so that the floor does not hide them."""
_ARM = 0.55
"""Distance from a person's middle to the hand that receives the ball, m."""
_AROUND = 1.9
"""Smallest radius around a mobile base that the camera should show, m."""


@final
class VelocityRun(SessionReport):
    """The data of a velocity-level session, see `app.worker.report.SessionReport`.

    Each role has one target: the goal of the role's first open task, (m,) m or (3, 3).
    """

    session: VelocitySession

    def targets(self) -> dict[str, np.ndarray]:
        progress = self.session.progress
        found: dict[str, np.ndarray] = {}
        for task in progress.mission[progress.l_0 :]:
            motion = task.motion
            raw = np.array(motion.goal) if isinstance(motion, Go) else motion.rotation
            if task.role not in found and raw is not None:
                found[task.role] = raw
        return found

    def path(self) -> np.ndarray:
        tip = self.session.robot.tip
        for role, task in self.session.roles.items():
            if isinstance(task, FramePosition) and (task.frame or tip) == tip:
                return self.session.predicted_path(role)
        return np.zeros((0, 3))

    def room(self) -> np.ndarray:
        if not base_joints(self.session.robot):
            return np.zeros((0, 3))
        tasks = self.session.progress.mission
        goals = [_point(task.motion.goal) for task in tasks if isinstance(task.motion, Go)]
        follows = [task.motion.reference for task in tasks if isinstance(task.motion, Follow)]
        goals += [_point(each.points[-1]) for each in follows if isinstance(each, Path)]
        corners = [np.array([x, y, 0.0]) for x in (-_AROUND, _AROUND) for y in (-_AROUND, _AROUND)]
        return np.array([*goals, *corners])

    def extras(self, running: bool, ran: bool) -> dict[str, Any]:
        return {"mission": self._mission()}

    def _mission(self) -> MissionView:
        session, progress = self.session, self.session.progress
        completed = dict(progress.completed)
        active = {each.task.name: each for each in progress.window}

        def row(place: int, task: MissionTask) -> MissionRow:
            entered = active.get(task.name)
            reached = None if entered is None else entered.reached
            return MissionRow(
                name=task.name,
                role=task.role,
                goal=_goal(task),
                tolerance=task.tolerance,
                hold=task.hold,
                state="done" if place < progress.l_0 else "active" if entered is not None else "ahead",
                there_s=None if reached is None else session.t - reached,
                done_at=completed.get(task.name),
            )

        ran = session.plan is not None
        return MissionView(
            rows=tuple(row(place, task) for place, task in enumerate(progress.mission)),
            done=progress.done,
            paths={
                role: np.array([_point(at) for at in session.predicted_path(role)]) + _ABOVE
                for role, task in session.roles.items()
                if ran and isinstance(task, FramePosition)
            },
            people=self._people(),
        )

    def _people(self) -> tuple[Person, ...]:
        """Returns the persons. Each person stands behind the hand-over point, as seen from the place to which
        the base drives for this hand-over."""
        options, progress = self.session.settings.options, self.session.progress
        visits: dict[int, list[tuple[MissionTask, bool]]] = {}
        beside: np.ndarray | None = None
        stands: dict[str, np.ndarray] = {}
        for place, task in enumerate(progress.mission):
            if not isinstance(task.motion, Go):
                continue
            if task.role == "base":
                beside = np.array(task.motion.goal)
            person = options.person(task.name)
            if person is not None:
                visits.setdefault(person, []).append((task, place < progress.l_0))
                stands[task.name] = np.zeros(2) if beside is None else beside
        people: list[Person] = []
        for person in sorted(visits):
            task = next((task for task, done in visits[person] if not done), visits[person][-1][0])
            assert isinstance(task.motion, Go)
            hand = _point(task.motion.goal)
            away = hand[:2] - stands[task.name]
            x, y = hand[:2] + _ARM * away / max(float(np.linalg.norm(away)), 1e-6)
            balls = sum(done for _, done in visits[person])
            people.append(
                Person((float(hand[0]), float(hand[1]), float(hand[2])), (float(x), float(y)), balls)
            )
        return tuple(people)


def _goal(task: MissionTask) -> tuple[float, ...] | None:
    """Returns the goal of a task, see `MissionRow`."""
    if isinstance(task.motion, Go):
        return task.motion.goal
    held = task.motion.rotation
    return None if held is None else tuple(quaternion(held).tolist())


def _point(values: tuple[float, ...] | np.ndarray) -> np.ndarray:
    """Returns a point in space, m, from the coordinates of a hand (3) or of a base on the floor (2)."""
    return np.array([*values, 0.0][:3], float)

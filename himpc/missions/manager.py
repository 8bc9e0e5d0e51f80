"""The task manager of the HTMPC paper's section IV: pure functions that decide which tasks the controller
receives.

At any time the controller receives the window [𝒯_{l₀}, …, 𝒯_{l₀+L−1}]; when 𝒯_{l₀} is completed, l₀ grows by
one. A task is planned when it enters the window, from the position of its point at that time. A task whose
goal is changed is planned again at the next call of `advanced`. An inserted task is planned when it enters
the window.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from himpc.kinematics.configuration import Configuration
from himpc.missions.mission import Follow, Go, Mission, MissionTask, Point, check_mission, find
from himpc.references import Reference
from himpc.tasks import Task
from robots import InputError
from robots.arrays import Array

_CLOCK = 1e-9
"""Largest rounding error of a sum of control periods, s."""


@dataclass(frozen=True, slots=True, eq=False)
class Active:
    """A task in the window.

    Attributes:
        task: the task.
        reference: its planned motion.
        counts_from: earliest time at which the goal counts as reached, s.
        reached: time at which the point reached the goal while the task was the first in the window, s; None:
            the point is not at the goal.
    """

    task: MissionTask
    reference: Reference
    counts_from: float
    reached: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Progress:
    """The progress of a mission.

    Attributes:
        mission: all tasks, including completed ones.
        l_0: l₀, the index of the first task in the window; the number of tasks when all are completed.
        window: the tasks that the controller receives, highest priority first.
        released: names of tasks whose hold was ended by `release`.
        completed: (name, time in s) of every completed task, in order.
    """

    mission: Mission
    l_0: int = 0
    window: tuple[Active, ...] = ()
    released: frozenset[str] = frozenset()
    completed: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        check_mission(self.mission)

    @property
    def done(self) -> bool:
        """Whether every task is completed."""
        return self.l_0 == len(self.mission)


def advanced(
    progress: Progress, L: int, t: float, points: Mapping[str, Array], speeds: Mapping[str, float]
) -> Progress:
    """Returns the progress at time t: completed tasks leave the window, later tasks enter it and are planned.

    When the mission is completed, its last window is kept, and the robot stays at its last goals.

    Args:
        progress: progress up to now.
        L: number of tasks in the window, ≥ 1.
        t: present time, s.
        points: position of each role's point, (m,) m.
        speeds: speed of each role's point, m/s.
    """
    while not progress.done:
        window = _window(progress, L, t, points)
        first = _watched(window[0], t, points, speeds)
        window = (first, *window[1:])
        if not _completed(first, progress.released, t):
            return replace(progress, window=window)
        progress = replace(
            progress,
            l_0=progress.l_0 + 1,
            window=window,
            completed=(*progress.completed, (first.task.name, t)),
        )
    return progress


def _window(progress: Progress, L: int, t: float, points: Mapping[str, Array]) -> tuple[Active, ...]:
    known = {active.task: active for active in progress.window}
    return tuple(
        known.get(task) or Active(task, *task.motion.planned(points[task.role], t))
        for task in progress.mission[progress.l_0 : progress.l_0 + max(L, 1)]
    )


def _watched(first: Active, t: float, points: Mapping[str, Array], speeds: Mapping[str, float]) -> Active:
    task = first.task
    goal = np.array(task.motion.goal) if isinstance(task.motion, Go) else _now(first.reference, t)
    there = (
        t >= first.counts_from - _CLOCK
        and float(np.linalg.norm(points[task.role] - goal)) <= task.tolerance
        and speeds[task.role] <= task.rest
    )
    if not there:
        return replace(first, reached=None)
    return first if first.reached is not None else replace(first, reached=t)


def _now(reference: Reference, t: float) -> Array:
    return reference.preview(t, 1.0, 0).value


def _completed(first: Active, released: frozenset[str], t: float) -> bool:
    if first.reached is None:
        return False
    if first.task.hold is None:
        return first.task.name in released
    return t - first.reached >= first.task.hold - _CLOCK


def release(progress: Progress, name: str) -> Progress:
    """Ends the hold of a task. If the task has not reached its goal yet, it will not wait at the goal.

    Raises:
        InputError: there is no such task, or the task does not wait for a release.
    """
    task = progress.mission[find(progress.mission, name)]
    if task.hold is not None:
        raise InputError(f"task '{name}' waits {task.hold:g} s at its goal: a release requires hold null")
    return replace(progress, released=progress.released | {name})


def move(progress: Progress, name: str, goal: Point) -> Progress:
    """Changes a task's goal: a point in m, or a quaternion x y z w for an orientation task. Points on the way
    are removed; time law and speed are kept.

    Raises:
        InputError: there is no such task, the task is completed or follows a given trajectory, or the goal
            does not fit.
    """
    index = _ahead(progress, name)
    task = progress.mission[index]
    moved = replace(task, motion=_elsewhere(task, goal))
    return replace(progress, mission=_spliced(progress.mission, index, index + 1, moved))


def _elsewhere(task: MissionTask, goal: Point) -> Go | Follow:
    motion, name = task.motion, task.name
    if isinstance(motion, Go):
        if len(goal) != len(motion.goal):
            raise InputError(f"the goal of task '{name}' needs {len(motion.goal)} numbers, not {len(goal)}")
        return replace(motion, goal=goal, via=())
    if motion.rotation is None:
        raise InputError(f"task '{name}' follows a given trajectory: it cannot be moved")
    return motion.turned(goal)


def insert(progress: Progress, task: MissionTask, before: str | None = None) -> Progress:
    """Inserts a new task before another one, or at the end.

    Raises:
        InputError: the other task is unknown or completed, or the new task's name already exists.
    """
    index = len(progress.mission) if before is None else _ahead(progress, before)
    return replace(progress, mission=_spliced(progress.mission, index, index, task))


def reorder(progress: Progress, name: str, to: int) -> Progress:
    """Moves a task to another index among the tasks that are not completed; the first has index 0. Plans are
    kept.

    Raises:
        InputError: there is no such task, the task is completed, or there is no such index.
    """
    index = _ahead(progress, name)
    left = len(progress.mission) - progress.l_0
    if not 0 <= to < left:
        raise InputError(f"task '{name}' cannot move to index {to}: give an index from 0 to {left - 1}")
    mission = list(progress.mission)
    mission.insert(progress.l_0 + to, mission.pop(index))
    return replace(progress, mission=tuple(mission))


def remove(progress: Progress, name: str) -> Progress:
    """Removes a task.

    Raises:
        InputError: there is no such task, the task is completed, or it is the only task.
    """
    index = _ahead(progress, name)
    return replace(progress, mission=_spliced(progress.mission, index, index + 1))


def _ahead(progress: Progress, name: str) -> int:
    index = find(progress.mission, name)
    if index < progress.l_0:
        raise InputError(f"task '{name}' is completed: choose a task that is not completed")
    return index


def _spliced(mission: Mission, start: int, end: int, *tasks: MissionTask) -> Mission:
    return (*mission[:start], *tasks, *mission[end:])


def where(at: Configuration, roles: Mapping[str, Task]) -> tuple[dict[str, Array], dict[str, float]]:
    """Returns the arguments `points` and `speeds` of `advanced`, by role.

    Args:
        at: the measured state.
        roles: the task of each role.

    Returns:
        the position (m,) in m, or the rotation matrix (3, 3), of each role's point, and the speed of each
        point in m/s or rad/s.
    """
    points = {name: task.value(at) for name, task in roles.items()}
    speeds = {name: float(np.linalg.norm(task.jacobian(at)[0] @ at.v)) for name, task in roles.items()}
    return points, speeds

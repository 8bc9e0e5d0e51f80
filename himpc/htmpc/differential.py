"""The base class of controllers that look no further than the present control period."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from time import perf_counter_ns
from typing import NamedTuple

import numpy as np

from himpc.htmpc.plan import LevelEvidence, VelocityPlan
from himpc.htmpc.prediction import Motion, Start
from himpc.htmpc.safety import commandable, plausible
from himpc.htmpc.settings import HTMPCSettings, MotionBounds, bounds
from himpc.kinematics.configuration import Configuration
from himpc.references import Preview
from himpc.stack import Stack
from himpc.tasks import Task
from robots import Robot
from robots.arrays import Array


class Box(NamedTuple):
    """An interval of velocities for each joint, (n,) each."""

    lower: Array
    upper: Array

    @property
    def rest(self) -> Array:
        """The velocity inside the box that is nearest to zero, (n,)."""
        return np.clip(np.zeros(self.lower.size), self.lower, self.upper)


class Solved(NamedTuple):
    """The velocity of this period, (n,), the evidence of every level, and what the user should know."""

    command: Array
    levels: tuple[LevelEvidence, ...]
    notice: str | None = None


class DifferentialController(ABC):
    """Computes one velocity per period from the present state and the present references. Of the settings it
    uses the stack, `gains`, the rate, and the limits without the jerk limit (section V-C)."""

    def __init__(self, robot: Robot, settings: HTMPCSettings) -> None:
        """Raises InputError if the settings do not fit the robot."""
        self.robot = robot
        self._data = robot.model.createData()
        self.configure(settings)
        self.reset()

    @property
    def settings(self) -> HTMPCSettings:
        """The settings in use."""
        return self._settings

    def reset(self) -> None:
        """Clears the last command."""
        self._last: Array | None = None

    def configure(self, settings: HTMPCSettings) -> None:
        """Applies new settings immediately; the last command is kept. If the settings do not fit, the method
        raises InputError and changes nothing."""
        home = Configuration(self.robot, self._data, self.robot.home, self.robot.home)
        for level in settings.stack:
            for task in level.tasks:
                task.jacobian(home)
        levels = tuple(level for level in settings.stack if level.enabled)
        limits = bounds(self.robot, settings.limits)
        self._fit(levels, settings)
        self._bounds, self._levels, self._settings = limits, levels, settings

    @abstractmethod
    def _fit(self, levels: Stack, settings: HTMPCSettings) -> None:
        """Prepares to solve these levels. Raises InputError, without any change, if they do not fit."""

    @abstractmethod
    def _solve(self, here: Configuration, previews: Mapping[str, Preview], box: Box) -> Solved:
        """Returns the velocity inside the box, with the evidence of all enabled levels."""

    def step(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> VelocityPlan:
        """Computes the command of one control period; only the first knot of each preview is used.

        Args:
            q, v: measured joint positions and velocities, (n,).
            previews: the reference of every task by its name.

        Returns:
            the plan with one knot. It is finite and inside the bounds for every state. If the state is not
            plausible, the command decreases to zero.
        """
        started = perf_counter_ns()
        settings, period = self._settings, self._settings.period
        usable = plausible(self.robot, q, v)
        q = np.array(q, float) if usable else self.robot.home
        last = self._last
        if last is None:
            last = commandable(v, None, self._bounds) if usable else np.zeros(self.robot.n)
        here = Configuration(self.robot, self._data, q, last, previews=previews)
        box = reachable(q, last, self._bounds, period)
        command, levels, notice = self._solve(here, previews, box) if usable else Solved(box.rest, ())
        start = Start(q, last, np.zeros(self.robot.n))
        motion = Motion(start, ((command - last) / period)[None], period)
        self._last = command
        tasks = [task for level in settings.stack for task in level.tasks]
        values = {task.name: task.value(here) for task in tasks}
        return VelocityPlan(
            command=command,
            motion=motion,
            q=np.vstack([q, motion.position(period)]),
            v=np.vstack([last, command]),
            u=motion.U,
            levels=levels,
            errors={task.name: task.error(values[task.name], previews[task.name].value) for task in tasks},
            values=values,
            bounds=self._bounds,
            clearance=np.inf,
            step_us=(perf_counter_ns() - started) / 1e3,
            notice=notice,
        )

    def _gain(self, index: int) -> float:
        """Returns the gain of an enabled level, 1/s; the last gain applies to all further levels."""
        gains = self._settings.gains
        return gains[min(index, len(gains) - 1)]


def wanted(task: Task, here: Configuration, previews: Mapping[str, Preview], gain: float) -> Array:
    """Returns ẋ = ṙ + gain · (r − x), (m,)."""
    preview = previews[task.name]
    velocity = task.reference_in_task_coordinates(here, preview).velocity[0]
    return velocity - gain * task.error(task.value(here), preview.value)


def reachable(q: Array, last: Array, limits: MotionBounds, T: float) -> Box:
    """Returns the box of reachable velocities inside all bounds in this period. If a joint has no such
    velocity, its interval contains only the reachable velocity that is nearest to the bounds.

    Args:
        q: joint positions, (n,).
        last: the last command, (n,).
        limits: the bounds that apply.
        T: control period, s.
    """
    reach = Box(last - limits.a * T, last + limits.a * T)
    upper = np.minimum(limits.v, _approach(limits.q_upper - q, limits, T))
    lower = np.maximum(-limits.v, -_approach(q - limits.q_lower, limits, T))
    return Box(np.clip(lower, reach.lower, reach.upper), np.clip(upper, reach.lower, reach.upper))


def _approach(room: Array, limits: MotionBounds, T: float) -> Array:
    """Returns the largest velocity from which a joint can still stop within `room`, with one command every T
    seconds. For a joint beyond its bound, returns minus the speed at which the joint moves back, at most a
    fifth of the speed limit."""
    braking = np.where(np.isfinite(limits.a), limits.a, 1e9)
    inside = braking * (np.sqrt(T * T + 2.0 * np.maximum(room, 0.0) / braking) - T)
    return np.where(room >= 0.0, inside, np.maximum(room, -0.2 * limits.v))

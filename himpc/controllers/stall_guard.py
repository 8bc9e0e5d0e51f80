"""Slows joints down while a controller keeps distances: all joints of a stalled robot, joints with little
torque left, and joints that accelerate. Without distances, it also stops a robot that presses."""

from __future__ import annotations

import math
from typing import final

import numpy as np
from numpy.typing import NDArray

from himpc.constants import BLOCKED, HEAVY_LOAD, PROGRESS
from himpc.formulation.settings import Settings
from himpc.limits import LimitsInForce
from himpc.limits.load import loaded, spared
from himpc.limits.overrun import anticipated, followed
from himpc.limits.stall import going, slowed, stalled
from himpc.limits.windup import Windup, free, largest_error, stopped, taken_back, wound_up
from himpc.tick.compiled_stall_guard import CompiledStallGuard
from himpc.tick.distances import Anywhere, Distances, carried
from robots import Robot

Array = NDArray[np.float64]


@final
class StallGuard:
    """Contains the degree to which the robot of a controller is stalled.

    Attributes:
        errors: (T,) the lengths of the tasks' errors at the last tick, m or rad; None before the first one.
        fastest: the largest velocity of a row of a reference at the last tick, m/s or rad/s.
        stall: the degree to which the robot is stalled.
        load: (n,) the mean load of each joint, as a share of its torque limit; None before the first tick.
        mean: (n,) rad/s, the mean velocity of each joint.
        largest_error: the largest error on which tasks act, m or rad.
    """

    def __init__(self, tasks: int, T_s: float, largest_error: float = math.inf) -> None:
        self._T_s, self.largest_error = T_s, largest_error
        self.errors: Array | None = None
        self.fastest = 0.0
        self.stall = going(tasks)
        self.load: Array | None = None
        self.mean: Array | None = None

    def limits(
        self, limits: LimitsInForce, tau: Array, v: Array, distances: Distances | Anywhere | None
    ) -> LimitsInForce:
        """Returns the limits in force at this tick. Velocity limits are lower while the robot is stalled, and
        for joints that accelerate or have little torque left.

        Args:
            limits: the limits without these reductions.
            tau: torque that acts, (n,) N·m.
            v: measured, (n,) rad/s.
            distances: the pairs of the last tick.
        """
        assert distances is not None
        T_s = self._T_s
        limits = limits.with_velocities((1.0 - distances.velocity_margin) * limits.v_limit)
        self.load = loaded(np.zeros_like(tau) if self.load is None else self.load, tau, limits, T_s)
        self.mean = followed(v if self.mean is None else self.mean, v, T_s)
        limits = anticipated(spared(limits, self.load, distances.carried), v, self.mean)
        if self.errors is not None:
            moves = distances.moves or self.fastest > PROGRESS
            room = min(distances.room, BLOCKED) if self.load.max() > HEAVY_LOAD else distances.room
            self.stall = stalled(self.stall, self.errors, moves, room, T_s)
        return slowed(limits, self.stall)


@final
class WindupGuard:
    """Guards a robot without distances. It slows joints down like a guard with distances whose obstacle is
    always near, and stops a robot that presses.

    Attributes:
        errors, fastest: as for `StallGuard`.
        windup: the degree to which the torque is wound up; None before the first tick.
    """

    def __init__(
        self, stall: StallGuard | CompiledStallGuard, robot: Robot, M_bar: Array, margin: float, T_s: float
    ) -> None:
        """stall: the guard for an obstacle that is near. M_bar: (n,) kg·m². margin: see `Avoidance`."""
        self._stall, self._around, self._T_s = stall, Anywhere(carried(robot), margin), T_s
        self._v_limit, self._largest = robot.v_limit, taken_back(M_bar, robot.v_limit, T_s)
        self.windup: Windup | None = None

    @property
    def errors(self) -> Array | None:
        return self._stall.errors

    @errors.setter
    def errors(self, errors: Array) -> None:
        self._stall.errors = errors

    @property
    def fastest(self) -> float:
        return self._stall.fastest

    @fastest.setter
    def fastest(self, fastest: float) -> None:
        self._stall.fastest = fastest

    def limits(self, limits: LimitsInForce, tau: Array, v: Array, _: object) -> LimitsInForce:
        """Returns the limits in force at this tick, see `StallGuard.limits`."""
        moves = self.fastest > PROGRESS
        before = free(tau) if self.windup is None else self.windup
        self.windup = wound_up(before, tau, v, self._largest, self._v_limit, moves, self._T_s)
        return stopped(self._stall.limits(limits, tau, v, self._around), self.windup)

    @property
    def largest_error(self) -> float:
        """The largest error on which tasks act at this tick, m or rad."""
        pressing = math.inf if self.windup is None else largest_error(self.windup)
        return min(self._stall.largest_error, pressing)


def guard_of(
    settings: Settings, tasks: int, robot: Robot
) -> StallGuard | CompiledStallGuard | WindupGuard | None:
    """Returns the guard for a controller on the route of its settings; None if the settings have no guard.

    Args:
        settings: the settings of the controller.
        tasks: the number of its tasks.
        robot: the robot that it controls.
    """
    limits, T_s = settings.limits, settings.T_s
    avoidance = limits.avoidance
    if not avoidance.on and not limits.stall_guard:
        return None
    kind = CompiledStallGuard if settings.route == "compiled" else StallGuard
    stall = kind(tasks, T_s, avoidance.pull or math.inf)
    if avoidance.on:
        return stall
    return WindupGuard(stall, robot, np.array(settings.M_bar), avoidance.velocity_margin, T_s)

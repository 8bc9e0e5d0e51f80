"""Slows joints down while a controller keeps distances: all joints of a stalled robot, joints with little
torque left, and joints that accelerate. Without distances, it stops a robot that presses."""

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
from himpc.limits.windup import Windup, free, largest_error, stopped, wound_up
from himpc.tick.compiled_stall_guard import CompiledStallGuard
from himpc.tick.distances import Distances

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
        self, limits: LimitsInForce, tau: Array, v: Array, distances: Distances | None
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
    """Contains the degree to which a controller without distances has wound up its torque.

    Attributes:
        errors, fastest: as for `StallGuard`; the errors have no effect.
        windup: the degree; None before the first tick.
    """

    def __init__(self, largest_torque: Array, T_s: float) -> None:
        """largest_torque: (n,) N·m."""
        self._largest_torque, self._T_s = largest_torque, T_s
        self.errors: Array | None = None
        self.fastest = 0.0
        self.windup: Windup | None = None

    def limits(self, limits: LimitsInForce, tau: Array, v: Array, _: object) -> LimitsInForce:
        """Returns the limits in force at this tick, see `StallGuard.limits`."""
        moves = self.fastest > PROGRESS
        before = free(tau) if self.windup is None else self.windup
        self.windup = wound_up(before, tau, v, self._largest_torque, moves, self._T_s)
        return stopped(limits, self.windup)

    @property
    def largest_error(self) -> float:
        """The largest error on which tasks act at this tick, m or rad."""
        return math.inf if self.windup is None else largest_error(self.windup)


def guard_of(
    settings: Settings, tasks: int, largest_torque: Array
) -> StallGuard | CompiledStallGuard | WindupGuard | None:
    """Returns the guard for a controller on the route of its settings; None if the settings have no guard.

    Args:
        settings: the settings of the controller.
        tasks: the number of its tasks.
        largest_torque: (n,) N·m.
    """
    limits, T_s = settings.limits, settings.T_s
    if limits.avoidance.on:
        kind = CompiledStallGuard if settings.route == "compiled" else StallGuard
        return kind(tasks, T_s, limits.avoidance.largest_error)
    return WindupGuard(largest_torque, T_s) if limits.stall_guard else None

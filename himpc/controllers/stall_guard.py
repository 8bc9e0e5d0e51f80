"""The guards of a controller, which lower velocity limits: one for controllers that keep distances, and one
for the others, which stops a robot that presses."""

from __future__ import annotations

import math
from typing import final

import numpy as np
from numpy.typing import NDArray

from himpc.constants import PROGRESS
from himpc.formulation.settings import Settings
from himpc.limits import LimitsInForce
from himpc.limits.windup import Windup, free, largest_error, stopped, wound_up
from himpc.tick.distances import Distances
from himpc.tick.kernel.slow_down import slow_down

Array = NDArray[np.float64]


_NONE = np.empty(0)


@final
class StallGuard:
    """Slows joints down while a controller keeps distances: all joints of a stalled robot, joints that are
    carried by a motor with little torque left, and joints that accelerate, see `tick.kernel.slow_down`.

    Attributes:
        errors: (T,) the lengths of the tasks' errors at the last tick, m or rad; None before the first one.
        fastest: the largest velocity of a row of a reference at the last tick, m/s or rad/s.
        largest_error: the largest error on which tasks act, m or rad.
    """

    def __init__(self, tasks: int, T_s: float, largest_error: float = math.inf) -> None:
        self._T_s, self.largest_error = T_s, largest_error
        self.errors: Array | None = None
        self.fastest = 0.0
        self._due, self._stall = np.full(tasks, np.inf), np.array((1.0, np.inf))
        self._joints: Array | None = None
        self._limits: tuple[LimitsInForce, Array, Array] | None = None

    def limits(
        self, limits: LimitsInForce, tau: Array, v: Array, distances: Distances | None
    ) -> LimitsInForce:
        """Returns the limits in force at this tick, with lower velocity limits.

        Args:
            limits: the limits without these reductions.
            tau: torque that acts, (n,) N·m.
            v: measured, (n,) rad/s.
            distances: the pairs of the last tick.
        """
        assert distances is not None
        if self._joints is None:
            self._joints = np.array((np.zeros_like(v), v))
        if self._limits is None or self._limits[0] is not limits:
            v_limit = (1.0 - distances.velocity_margin) * limits.v_limit
            self._limits = limits, v_limit, limits.largest_torque
        load, mean = self._joints
        slower = np.empty(len(v))
        slow_down(
            *(*self._limits[1:], tau, v, distances.carried, distances.room),
            *(distances.moves or self.fastest > PROGRESS, self._T_s),
            *(_NONE if self.errors is None else self.errors, self._due, self._stall, load, mean, slower),
        )
        return limits.with_velocities(slower)


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


def guard_of(settings: Settings, tasks: int, largest_torque: Array) -> StallGuard | WindupGuard | None:
    """Returns the guard for a controller; None if the settings have no guard.

    Args:
        settings: the settings of the controller.
        tasks: the number of its tasks.
        largest_torque: (n,) N·m.
    """
    limits, T_s = settings.limits, settings.T_s
    if limits.avoidance.on:
        return StallGuard(tasks, T_s, limits.avoidance.largest_error)
    return WindupGuard(largest_torque, T_s) if limits.stall_guard else None

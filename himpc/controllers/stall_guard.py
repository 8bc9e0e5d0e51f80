"""The guards of a controller, which lower velocity limits: one for controllers that keep distances, and one
for the others, which also stops a robot that presses."""

from __future__ import annotations

import math
from typing import final

import numpy as np
from numpy.typing import NDArray

from himpc.formulation.settings import Settings
from himpc.limits import LimitsInForce
from himpc.tick.distances import Anywhere, Distances, carried
from himpc.tick.kernel.slow_down import slow_down
from himpc.tick.kernel.windup import resist_windup_of
from robots import Robot

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

    def recall(self, before: StallGuard) -> None:
        """Takes over what the guard of the settings before knew of the joints. Whether the tasks make
        progress is observed anew, as with other settings they may."""
        self._joints, self.fastest = before._joints, before.fastest

    def limits(
        self, limits: LimitsInForce, tau: Array, v: Array, distances: Distances | Anywhere | None
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
            *(distances.moves or self.fastest > distances.moving, self._T_s),
            *(_NONE if self.errors is None else self.errors, self._due, self._stall, load, mean, slower),
        )
        return limits.with_velocities(slower)


@final
class WindupGuard:
    """Guards a robot without distances. It slows joints down like a guard with distances whose obstacle is
    always near, and stops a robot that presses, see `tick.kernel.windup`.

    Attributes:
        errors, fastest: as for `StallGuard`.
        largest_error: the largest error on which tasks act at this tick, m or rad.
    """

    def __init__(self, stall: StallGuard, robot: Robot, M_bar: Array, margin: float, T_s: float) -> None:
        """stall: the guard for an obstacle that is near. M_bar: (n,) kg·m². margin: see `Avoidance`."""
        self._stall, self._around, self._T_s = stall, Anywhere(carried(robot), margin), T_s
        self._v_limit, self._M_bar = np.array(robot.v_limit), M_bar
        self._tau: Array | None = None
        self._wound, self._windup = np.zeros(robot.n), np.array((0.0, 1.0))
        self.largest_error = stall.largest_error

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

    def recall(self, before: WindupGuard) -> None:
        """Takes over what the guard of the settings before knew of the joints, and how far they are wound
        up."""
        self._stall.recall(before._stall)
        self._tau, self._wound, self._windup = before._tau, before._wound, before._windup

    def limits(self, limits: LimitsInForce, tau: Array, v: Array, _: object) -> LimitsInForce:
        """Returns the limits in force at this tick, see `StallGuard.limits`."""
        if self._tau is None:
            self._tau = np.array(tau)
        slowed = self._stall.limits(limits, tau, v, self._around)
        pressing = resist_windup_of(
            *(self._M_bar, self._v_limit, tau, v, self.fastest > self._around.moving, self._T_s),
            *(self._tau, self._wound, self._windup, slowed.v_limit),
        )
        self.largest_error = min(self._stall.largest_error, pressing)
        return slowed


Guard = StallGuard | WindupGuard


def guard_of(settings: Settings, tasks: int, robot: Robot, before: Guard | None = None) -> Guard | None:
    """Returns the guard for a controller; None if the settings have no guard.

    Args:
        settings: the settings of the controller.
        tasks: the number of its tasks.
        robot: the robot that it controls.
        before: the guard of the settings before, if they change while the robot moves.
    """
    limits, T_s = settings.limits, settings.T_s
    avoidance = limits.avoidance
    if not avoidance.on and not limits.stall_guard:
        return None
    guard = StallGuard(tasks, T_s, avoidance.pull or math.inf)
    if not avoidance.on:
        guard = WindupGuard(guard, robot, np.array(settings.M_bar), avoidance.velocity_margin, T_s)
    if isinstance(guard, StallGuard) and isinstance(before, StallGuard):
        guard.recall(before)
    if isinstance(guard, WindupGuard) and isinstance(before, WindupGuard):
        guard.recall(before)
    return guard

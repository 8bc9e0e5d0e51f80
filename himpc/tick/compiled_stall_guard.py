"""A `StallGuard` that uses the compiled kernel."""

from __future__ import annotations

import math
from typing import final

import numpy as np
from numpy.typing import NDArray

from himpc.constants import PROGRESS
from himpc.limits import LimitsInForce
from himpc.tick.distances import Anywhere, Distances
from himpc.tick.kernel.slow_down import slow_down

Array = NDArray[np.float64]


_NONE = np.empty(0)


@final
class CompiledStallGuard:
    """Contains the degree to which the robot of a controller is stalled. Its attributes are those of
    `StallGuard`."""

    def __init__(self, tasks: int, T_s: float, largest_error: float = math.inf) -> None:
        self._T_s, self.largest_error = T_s, largest_error
        self.errors: Array | None = None
        self.fastest = 0.0
        self._due, self._stall = np.full(tasks, np.inf), np.array((1.0, np.inf))
        self._joints: Array | None = None
        self._limits: tuple[LimitsInForce, Array, Array] | None = None

    def limits(
        self, limits: LimitsInForce, tau: Array, v: Array, distances: Distances | Anywhere | None
    ) -> LimitsInForce:
        """Returns the limits in force at this tick, see `StallGuard.limits`."""
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

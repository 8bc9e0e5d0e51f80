"""Slows the joints down while a robot is stalled, for a controller that keeps distances."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from himpc.limits import LimitsInForce
from himpc.limits.load import loaded, spared
from himpc.limits.stall import PROGRESS, going, slowed, stalled
from himpc.tick.distances import Distances

Array = NDArray[np.float64]


@final
class StallGuard:
    """Remembers how far its controller's robot is stalled.

    Attributes:
        errors: (T,) the lengths of the tasks' errors at the last tick, m or rad; None before the first one.
        stall: how far it is stalled.
        load: (n,) the mean load of its joints, as a share of their torque limits; None before the first tick.
    """

    def __init__(self, tasks: int, T_s: float) -> None:
        self._T_s = T_s
        self.errors: Array | None = None
        self.stall = going(tasks)
        self.load: Array | None = None

    def limits(
        self, limits: LimitsInForce, tau: Array, fastest: float, distances: Distances
    ) -> LimitsInForce:
        """The limits in force at this tick, with lower velocities while the robot is stalled, and of joints
        with little torque left.

        Args:
            limits: without that.
            tau: torque that acts, (n,) N·m.
            fastest: the largest velocity of a row of a reference, m/s or rad/s.
            distances: the pairs of the last tick.
        """
        before = np.zeros_like(tau) if self.load is None else self.load
        self.load = loaded(before, tau, limits, self._T_s)
        limits = spared(limits, self.load)
        if self.errors is not None:
            moves = distances.moves or fastest > PROGRESS
            self.stall = stalled(self.stall, self.errors, moves, distances.room, self._T_s)
        return slowed(limits, self.stall)

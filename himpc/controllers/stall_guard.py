"""Slows the joints down while a robot is stalled, for a controller that keeps distances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import numpy as np
from numpy.typing import NDArray

from himpc.limits import LimitsInForce
from himpc.limits.stall import PROGRESS, going, slowed, stalled
from himpc.references import Preview
from himpc.tasks import Damping, Task
from himpc.tick.distances import Distances

Array = NDArray[np.float64]


@final
class StallGuard:
    """Remembers how far its controller's robot is stalled.

    Attributes:
        errors: (T,) the lengths of the tasks' errors at the last tick, m or rad; None before the first one.
        stall: how far it is stalled.
    """

    def __init__(self, tasks: Sequence[Task], T_s: float) -> None:
        self._tasks, self._T_s = tasks, T_s
        self.errors: Array | None = None
        self.stall = going(len(tasks))

    def limits(
        self, limits: LimitsInForce, previews: Mapping[str, Preview], distances: Distances
    ) -> LimitsInForce:
        """The limits in force at this tick, with lower velocities while the robot is stalled."""
        if self.errors is not None:
            moves = distances.moves or any(
                float(np.abs(previews[task.name].velocity[0]).max()) > PROGRESS
                for task in self._tasks
                if not isinstance(task, Damping)
            )
            self.stall = stalled(self.stall, self.errors, moves, distances.room, self._T_s)
        return slowed(limits, self.stall)

"""The velocity commands that the servos get during one control period."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc import VelocityPlan

Array = NDArray[np.float64]

COMMAND_HZ = 100.0
"""Rate at which the servos get a new velocity, 1/s, as on the authors' robot."""


def command_step(period: float) -> tuple[int, float]:
    """Returns the number of commands in a control period, and the time between two commands, s."""
    count = max(1, round(period * COMMAND_HZ))
    return count, period / count


class Commands:
    """The commands of a plan during one control period.

    Attributes:
        plan: the plan.
        period: the time for which the plan is carried out, s.
        h: time between two commands, s.
        last: the last command, (n,) rad/s (m/s).
        sharpest: the largest |acceleration| so far, (n,) rad/s² (m/s²).
    """

    def __init__(self, plan: VelocityPlan, period: float, before: Array) -> None:
        """before: the last command of the previous period, (n,)."""
        self.plan, self.period = plan, period
        self._count, self.h = command_step(period)
        self._returned = 0
        self.last = before
        self.sharpest = np.zeros_like(before)

    def next(self) -> Array:
        """Returns the next command, (n,)."""
        self._returned += 1
        command = self.plan.motion.velocity(self._returned * self.h)
        self.sharpest = np.maximum(self.sharpest, np.abs((command - self.last) / self.h))
        self.last = command
        return command

    @property
    def done(self) -> bool:
        """Whether all commands of the period were returned."""
        return self._returned == self._count

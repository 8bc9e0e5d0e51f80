"""The commands of a controller on their way to the plant: a torque that may be late, velocities in steps."""

from __future__ import annotations

import numpy as np

from himpc.htmpc import VelocityPlan
from robots.arrays import Array


class DelayedTorque:
    """A queue of length one, in which a late torque waits for the next tick.

    A tick whose torque is in time applies it and discards the waiting torque: an old torque never acts after
    a newer one. A tick whose torque is late applies the waiting torque or, if there is none, holds the torque
    of the previous tick; its own torque then waits. So one late tick costs one tick of holding. Of two late
    ticks in a row, the second applies the torque of the first. A controller that is always late acts exactly
    like one whose torque is delayed by one tick. A torque waits at most one tick, however late it is.
    """

    def __init__(self) -> None:
        self._held: Array | None = None
        self._waiting: Array | None = None

    def applied(self, tau: Array, late: bool, before: Array) -> Array:
        """Returns the torque that this tick applies, (n,) N·m.

        Args:
            tau: the controller's torque for this tick, (n,) N·m.
            late: whether it was ready only after the deadline.
            before: the torque that acted until now, (n,) N·m; held if this is the first tick.
        """
        if not late:
            taken, self._waiting = tau, None
        else:
            held = before if self._held is None else self._held
            taken = held if self._waiting is None else self._waiting
            self._waiting = tau
        self._held = taken
        return taken


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

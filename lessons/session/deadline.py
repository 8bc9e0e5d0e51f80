"""Deadlines: chooses the torque that a tick applies if the controller's torque is not ready in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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

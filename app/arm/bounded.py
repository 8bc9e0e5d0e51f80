"""An arm whose calls cannot block forever."""

from __future__ import annotations

import signal
from typing import final

import numpy as np
from numpy.typing import NDArray

from robots.arms.arm import Arm, Reading

Array = NDArray[np.float64]

STUCK = 5.0
"""Time, s, after which a call that has not returned ends the process. The arm then stops by itself."""


@final
class Bounded(Arm):
    """Passes all calls on to another arm. If a call blocks in the compiled code of the arm's library, no
    exception can end it. The operating system then ends the process."""

    def __init__(self, arm: Arm, stuck: float = STUCK) -> None:
        """stuck: longest time of a call, s, see STUCK."""
        self.limits, self._arm, self._stuck = arm.limits, arm, stuck
        signal.signal(signal.SIGALRM, signal.SIG_DFL)

    def read(self) -> Reading:
        signal.setitimer(signal.ITIMER_REAL, self._stuck)
        return self._arm.read()

    def write(self, tau: Array) -> None:
        self._arm.write(tau)

    def stop(self) -> None:
        signal.setitimer(signal.ITIMER_REAL, self._stuck)
        self._arm.stop()
        signal.setitimer(signal.ITIMER_REAL, 0.0)

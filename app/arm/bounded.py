"""An arm whose calls cannot hang for ever."""

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
    """Passes all calls on to another arm. If the arm's library waits forever in compiled code, where no
    exception can end it, the operating system ends the process."""

    def __init__(self, arm: Arm, stuck: float = STUCK) -> None:
        """stuck: s, see STUCK."""
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

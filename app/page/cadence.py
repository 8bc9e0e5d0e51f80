"""How often a page is updated: less often while its robot stands still or simulated time is slowed down."""

from __future__ import annotations

import math
from typing import final

POSES, PLOTS, TEXTS = 30.0, 12.0, 3.75  # Hz, while simulated time is as fast as real time
CALM = 6.0  # Hz, the rate of poses, plots and texts when the robot has stood still for STILL
STILL = 1.0  # s
LEAST = 1 / 3
"""The smallest factor by which POSES and PLOTS are multiplied while simulated time is slowed down."""


@final
class Cadence:
    """The rates of one page. Times are arguments, so that tests need no clock."""

    def __init__(self) -> None:
        self._shown: object = None
        self._moved = -math.inf
        self._share = 1.0
        self._next_plots = self._next_texts = 0.0

    def shown(self, instant: object, pace: float, now: float) -> float:
        """Returns the time until the page should check for changes again, s.

        Args:
            instant: identifies the instant that is shown; None while no instant is shown.
            pace: simulated seconds per real second if simulated time is slowed down, otherwise 1.
            now: the present time, s.
        """
        if instant is None or instant != self._shown:
            self._shown, self._moved = instant, now
        self._share = min(1.0, max(LEAST, pace))
        return 1 / CALM if self._calm(now) else 1 / (self._share * POSES)

    def plots_due(self, now: float) -> bool:
        """Returns whether the plots should be drawn now."""
        if self._calm(now):
            return True
        if now < self._next_plots:
            return False
        # The page checks slightly too early or too late; this limit keeps the average rate.
        late = now - 1 / (self._share * POSES)
        self._next_plots = max(self._next_plots, late) + 1 / (self._share * PLOTS)
        return True

    def texts_due(self, now: float) -> bool:
        """Returns whether the texts should be written now. Slowed simulated time does not reduce their
        rate."""
        if now < self._next_texts and not self._calm(now):
            return False
        self._next_texts = now + 1 / TEXTS
        return True

    def _calm(self, now: float) -> bool:
        return now - self._moved > STILL

"""Computes the simulated time that is due. No tick is ever skipped."""

from __future__ import annotations

BACKLOG = 0.1
"""Largest time, s, by which the simulation may be late: real time if the requested speed is above 1,
otherwise simulated time. If it is later, simulated time slows down and no further work accumulates."""
_MEMORY = 1.0
"""Time, s, over which the real-time factor is averaged and for which a slowdown is shown."""


class Pacer:
    """Computes the simulated time that is due. Times are arguments, so that tests need no clock."""

    def __init__(self, now: float) -> None:
        self.speed = 1.0
        self._last = now
        self._debt = 0.0
        self._capped_at = -float("inf")
        self._window: tuple[float, float] = (now, 0.0)
        self._ran = 0.0
        self._factor = 0.0

    def due(self, now: float, T_s: float) -> int:
        """Returns the number of ticks to run now."""
        self._debt += (now - self._last) * self.speed
        self._last = now
        most = BACKLOG * max(1.0, self.speed)
        if self._debt > most:
            self._debt = most
            self._capped_at = now
        return int(self._debt / T_s + 1e-9)

    def ran(self, ticks: int, T_s: float) -> None:
        """Notes that this number of ticks was run."""
        self._debt -= ticks * T_s
        self._ran += ticks * T_s

    def rest(self, now: float) -> None:
        """Called while the simulation is paused or loads a scene. This time does not count as due."""
        self._last = now
        self._debt = 0.0
        self._window = (now, self._ran)
        self._factor = 0.0
        self._capped_at = -float("inf")

    def capped(self, now: float) -> bool:
        """Returns whether simulated time was slowed down within the last second."""
        return now - self._capped_at < _MEMORY

    def real_time_factor(self, now: float) -> float:
        """Returns simulated over real seconds, averaged over about a second."""
        start, ran = self._window
        if now - start >= 0.5 * _MEMORY:
            self._factor = (self._ran - ran) / (now - start)
            self._window = (now, self._ran)
        return self._factor

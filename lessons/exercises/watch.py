"""Measures how long a process itself takes to answer: the time in which it computes or sleeps."""

from __future__ import annotations

import time
from typing import final

from robots.processes.family import spent
from robots.processes.isolation import PATIENCE

LOOK = 0.1
"""s between two checks of a process that has not answered."""


@final
class ProcessDeadline:
    """The deadline of one answer of a process. Time that the process waits for a core of a busy machine does
    not count; with this time, the answer may take at most `PATIENCE` times as long.

    Attributes:
        seconds: time that the answer may take, s.
        what: the activity, for the beginning of a sentence.
        began: time at which the request was sent.
        slept: time up to the last check in which it neither computed nor waited for a core, s.
    """

    def __init__(self, pid: int, seconds: float, what: str) -> None:
        self.seconds, self.what, self.began = seconds, what, time.monotonic()
        self._pid, self.slept = pid, 0.0
        self._last: float | None = None
        self._computed = 0.0

    @property
    def passed(self) -> float:
        """Time since the request, s."""
        return time.monotonic() - self.began

    def over(self) -> bool:
        """Whether it took too long. Call this every tenth of a second."""
        now = time.monotonic()
        computed, asleep = spent(self._pid)
        if self._last is None:
            self._last, self._computed = now, computed
        elif asleep:
            self.slept += now - self._last
        self._last = now
        own = computed - self._computed + self.slept
        return own > self.seconds or self.passed > PATIENCE * self.seconds

"""Measures the time in which a process computes or sleeps until it answers."""

from __future__ import annotations

import time
from typing import final

from robots.processes.family import spent
from robots.processes.isolation import PATIENCE

LOOK = 0.1
"""Time between two checks of a process that has not answered, s."""


@final
class ProcessDeadline:
    """The deadline of one answer of a process. The time in which the process waits for a core of a busy
    machine does not count. Including this time, the answer may take `PATIENCE` times as long.

    Attributes:
        seconds: time that the answer may take, s.
        what: the activity, as the beginning of an error message.
        began: time at which the request was sent.
        slept: time, s, in which the process neither computed nor waited for a core, up to the last check.
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
        """Returns whether the answer has taken too long. Call this every tenth of a second."""
        now = time.monotonic()
        computed, asleep = spent(self._pid)
        if self._last is None:
            self._last, self._computed = now, computed
        elif asleep:
            self.slept += now - self._last
        self._last = now
        own = computed - self._computed + self.slept
        return own > self.seconds or self.passed > PATIENCE * self.seconds

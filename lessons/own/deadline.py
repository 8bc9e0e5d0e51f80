"""Calls with a time limit, which counts only the time that the call itself uses."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import ParamSpec, TypeVar, final

from robots.processes.isolation import waited

_P = ParamSpec("_P")
_T = TypeVar("_T")


class TooLong(BaseException):
    """Is raised to end a call. It is a BaseException, which user code does not catch by mistake."""


def within(seconds: float, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
    """Returns function(…). Raises TooLong if the call takes longer than `seconds`."""
    return CallDeadline(seconds).call(function, *args, **kwargs)


@final
class CallDeadline:
    """Ends calls that take too long, in the main thread of a POSIX system. Computing and sleeping count;
    waiting for a core on a busy machine does not. The waiting time is read only after the first alarm, since
    reading it takes as long as a short call.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._computed = 0.0
        self._since: tuple[float, float] | None = None
        self._heard = False

    def call(self, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Returns function(…). Raises TooLong if the call takes too long."""
        if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
            return function(*args, **kwargs)
        self._begin()
        before = signal.signal(signal.SIGALRM, self._hear)
        signal.setitimer(signal.ITIMER_REAL, self._seconds)
        try:
            return function(*args, **kwargs)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)

    def _begin(self) -> None:
        """Starts the measurement of a call's time."""
        self._computed = time.thread_time()
        self._since = (time.monotonic(), waited(os.getpid())) if self._heard else None

    def _hear(self, _: int, __: FrameType | None) -> None:
        """Handles the alarm: raises TooLong, or sets the alarm again."""
        if time.thread_time() - self._computed > 0.9 * self._seconds:
            raise TooLong
        now, starved = time.monotonic(), waited(os.getpid())
        if self._since is None:
            self._since, self._heard = (now, starved), True
        own = now - self._since[0] - (starved - self._since[1])
        if own > 0.98 * self._seconds:
            raise TooLong
        signal.setitimer(signal.ITIMER_REAL, self._seconds - own)

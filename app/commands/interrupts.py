"""Ctrl-C and SIGTERM end a command soon and without a traceback, whatever it is doing."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs
    from types import FrameType

PATIENCE = 4.5
"""Time, s, that a command has to end by itself."""
_AGAIN = 0.05  # s after which an interrupt that a library ignored is raised again
_LATER = 0.02  # s after which it is raised if that happens while the swallowed one is still being reported

Interrupted = threading.Event
"""Set once a signal has arrived."""


@contextmanager
def interruptible() -> Iterator[Interrupted]:
    """Within this context both signals raise KeyboardInterrupt in the main thread, so that results are kept
    and no process is left behind. A library (e.g. a compiler) may take long or swallow the exception: it is
    then raised again, and after PATIENCE the process ends at once, with its children.

    Yields a flag that says whether a signal has arrived: an interrupted import may then fail in any way.
    """
    interrupted = Interrupted()
    if threading.current_thread() is not threading.main_thread():
        yield interrupted
        return

    def interrupt(_: int, frame: FrameType | None) -> None:
        interrupted.set()
        if frame is None or frame.f_code is not unraisable.__code__:
            raise KeyboardInterrupt
        signal.setitimer(signal.ITIMER_REAL, _LATER)  # Python would report an exception raised in its hook

    def unraisable(report: UnraisableHookArgs) -> None:
        if interrupted.is_set():
            signal.setitimer(signal.ITIMER_REAL, _AGAIN)
        else:
            hook(report)

    numbers = [signal.SIGTERM, signal.SIGALRM]
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        numbers.append(signal.SIGINT)
    before = [signal.signal(number, interrupt) for number in numbers]
    hook, sys.unraisablehook = sys.unraisablehook, unraisable
    with _deadline():
        try:
            yield interrupted
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            sys.unraisablehook = hook
            for number, handler in zip(numbers, before, strict=True):
                signal.signal(number, handler)


@contextmanager
def _deadline() -> Iterator[None]:
    """A thread that receives signals even while the main thread is inside a library, and ends the process if
    that lasts too long."""
    heard, told = os.pipe()
    os.set_blocking(told, False)
    done = threading.Event()

    def watch() -> None:
        while number := os.read(heard, 1):
            if number[0] in (signal.SIGINT, signal.SIGTERM):
                if not done.wait(PATIENCE):
                    os._exit(130)
                return

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    outer = signal.set_wakeup_fd(told, warn_on_full_buffer=False)
    try:
        yield
    finally:
        done.set()
        signal.set_wakeup_fd(outer)
        os.close(told)
        watcher.join()
        os.close(heard)

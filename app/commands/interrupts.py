"""With this module, Ctrl-C and SIGTERM end a command soon and without a traceback, at any moment."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from app.link.threads import on_thread

if TYPE_CHECKING:
    from sys import UnraisableHookArgs
    from types import FrameType

PATIENCE = 4.5
"""Time, s, within which a command must end by itself."""
_AGAIN = 0.05  # s; after that, an interrupt that a library ignored is raised again
_LATER = 0.02  # s; time until the next attempt if Python is still reporting the ignored exception

Interrupted = threading.Event
"""Set once a signal has arrived."""


@contextmanager
def interruptible() -> Iterator[Interrupted]:
    """Within this context both signals raise KeyboardInterrupt in the main thread, so that results are stored
    and no process is left running. If a library (e.g. a compiler) takes long or swallows the exception, the
    exception is raised again. After PATIENCE the process and its children are ended at once.

    Yields a flag that is set when a signal has arrived. An interrupted import may then fail with any
    exception.
    """
    interrupted = Interrupted()
    if threading.current_thread() is not threading.main_thread():
        yield interrupted
        return

    def interrupt(_: int, frame: FrameType | None) -> None:
        interrupted.set()
        if frame is None or frame.f_code is not unraisable.__code__:
            raise KeyboardInterrupt
        signal.setitimer(signal.ITIMER_REAL, _LATER)  # an exception in Python's hook is only reported

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
    """A thread that receives signals even while the main thread runs code of a library. It ends the process
    if that code runs too long."""
    heard, told = os.pipe()
    os.set_blocking(told, False)
    done = threading.Event()

    def watch_on_thread() -> None:
        while number := os.read(heard, 1):
            if number[0] in (signal.SIGINT, signal.SIGTERM):
                if not done.wait(PATIENCE):
                    os._exit(130)
                return

    watcher = on_thread("interrupts", watch_on_thread)
    outer = signal.set_wakeup_fd(told, warn_on_full_buffer=False)
    try:
        yield
    finally:
        done.set()
        signal.set_wakeup_fd(outer)
        os.close(told)
        watcher.join()
        os.close(heard)

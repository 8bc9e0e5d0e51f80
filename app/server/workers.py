"""The threads of one page. The page's callbacks run on these threads, and do not block other pages."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from app.adapter.removed_handle_errors import unless_removed

THREADS = 4
WAITING = 64
"""Largest number of calls that wait for a thread; further calls are dropped."""


class Workers(ThreadPoolExecutor):
    """A thread pool that drops calls beyond its limit, and all calls after its shutdown."""

    def __init__(self, threads: int = THREADS, waiting: int = WAITING) -> None:
        super().__init__(threads, thread_name_prefix="page")
        self._room = threading.Semaphore(threads + waiting)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submits a call; returns a future with the result None if the call is dropped."""
        if not self._room.acquire(blocking=False):
            return _dropped()
        try:
            future = super().submit(unless_removed, fn, *args, **kwargs)
        except RuntimeError:  # the pool was shut down when its page closed
            self._room.release()
            return _dropped()
        future.add_done_callback(lambda _: self._room.release())
        return future


def _dropped() -> Future[Any]:
    future: Future[Any] = Future()
    future.set_result(None)
    return future

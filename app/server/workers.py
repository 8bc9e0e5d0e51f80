"""Threads of one page: what keeps them busy keeps nobody else waiting."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from app.adapter.removed_handle_errors import unless_removed

THREADS = 4
WAITING = 64
"""Calls that wait for a thread; whatever comes beside them is dropped."""


class Workers(ThreadPoolExecutor):
    """Drops what is too much, and everything once it is shut down."""

    def __init__(self, threads: int = THREADS, waiting: int = WAITING) -> None:
        super().__init__(threads, thread_name_prefix="page")
        self._room = threading.Semaphore(threads + waiting)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """A future of None for what is dropped."""
        if not self._room.acquire(blocking=False):
            return _dropped()
        try:
            future = super().submit(unless_removed, fn, *args, **kwargs)
        except RuntimeError:  # shut down: its page has been closed
            self._room.release()
            return _dropped()
        future.add_done_callback(lambda _: self._room.release())
        return future


def _dropped() -> Future[Any]:
    future: Future[Any] = Future()
    future.set_result(None)
    return future

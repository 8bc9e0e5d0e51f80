"""An event that wakes viser's sender from any thread."""

from __future__ import annotations

import asyncio
import contextlib


class ThreadSafeEvent(asyncio.Event):
    """An asyncio event that is always set on its event loop.

    asyncio's own event must only be set on its loop. viser 1.1 sets the event of its sender directly from any
    thread, and then asks the loop to set the event as well. Every few hours, the direct call occurs between
    the sender's last check and its wait. The event is then set although the sender waits, and the loop's call
    has no effect, so the page is never updated again. An event of this class ignores calls from other
    threads, so that only the loop sets the event. A picture of many messages then wakes the sender once.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._home = loop

    def set(self) -> None:
        with contextlib.suppress(RuntimeError):  # the thread has no event loop
            if asyncio.get_running_loop() is self._home:
                super().set()

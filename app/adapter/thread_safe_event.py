"""An event that wakes viser's sender from any thread."""

from __future__ import annotations

import asyncio
import contextlib


class ThreadSafeEvent(asyncio.Event):
    """An asyncio event that is always set on its event loop.

    asyncio's own event may only be set on its loop. viser 1.1 sets the event of its sender from any thread,
    and then asks the loop to set it as well. Every few hours this happens between the sender's last check and
    its wait. The event is then set although the sender waits, and setting it again has no effect: the page is
    never updated again. When another thread sets an event of this class, the loop sets it instead. A picture
    of many messages then wakes the sender once.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._home = loop

    def set(self) -> None:
        with contextlib.suppress(RuntimeError):  # the thread has no event loop
            if asyncio.get_running_loop() is self._home:
                super().set()

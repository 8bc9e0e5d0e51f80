"""What wakes viser's sender, whichever thread writes."""

from __future__ import annotations

import asyncio
import contextlib


class ThreadSafeEvent(asyncio.Event):
    """An event that is set on its loop only.

    asyncio's own may not be set elsewhere, and viser 1.1 sets its sender's from whatever thread writes, and
    then asks the loop to set it, too. Once in hours that falls between the sender's last look and its sleep.
    The event is set then, its sender asleep, and what is set already wakes nobody: the page stands still for
    good. So what another thread sets is left to the loop; a picture of many messages then wakes it once.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._home = loop

    def set(self) -> None:
        with contextlib.suppress(RuntimeError):  # a thread without a loop
            if asyncio.get_running_loop() is self._home:
                super().set()

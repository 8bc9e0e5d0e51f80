"""What wakes viser's sender, from any thread."""

from __future__ import annotations

import asyncio
import contextlib


class WakeUp(asyncio.Event):
    """An event that is set on its loop, whoever sets it.

    asyncio's own may be set on their loop only, and viser 1.1 sets its sender's from whatever thread writes.
    Once in hours that falls between the sender's last look and its sleep. The event is set then, its sender
    asleep, and what is set already wakes nobody: the page stands still for good.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__()
        self._home = loop

    def set(self) -> None:
        wake = super().set
        try:
            here = asyncio.get_running_loop() is self._home
        except RuntimeError:
            here = False  # a thread without a loop
        if here:
            wake()
            return
        with contextlib.suppress(RuntimeError):  # the loop has ended, and so has the sender
            self._home.call_soon_threadsafe(wake)

"""A page's sender does not miss a wake-up from another thread."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from app.adapter.private import ThreadSafeEvent


class Meeting(deque[Any]):
    """Replaces an event's list of waiters. Another thread sets the event just before the first waiter starts
    to wait."""

    def __init__(self, event: asyncio.Event) -> None:
        super().__init__()
        self._event = event
        self._met = False

    def append(self, waiter: Any) -> None:
        if not self._met:
            self._met = True
            thread = threading.Thread(target=self._event.set)
            thread.start()
            thread.join()
        super().append(waiter)


async def wakes(event: asyncio.Event) -> bool:
    """Returns whether a waiter wakes up if another thread sets the event at that moment, by this call or by a
    later one."""
    event._waiters = Meeting(event)  # pyright: ignore[reportAttributeAccessIssue]
    waiter = asyncio.ensure_future(event.wait())
    await asyncio.sleep(0.1)
    asyncio.get_running_loop().call_soon_threadsafe(event.set)
    done, _ = await asyncio.wait([waiter], timeout=0.5)
    waiter.cancel()
    return bool(done)


def test_a_sender_wakes_though_it_is_called_while_it_goes_to_sleep() -> None:
    async def both() -> tuple[bool, bool]:
        return await wakes(ThreadSafeEvent(asyncio.get_running_loop())), await wakes(asyncio.Event())

    with ThreadPoolExecutor(1) as elsewhere:  # the browser of other tests has an event loop on this thread
        ours, plain = elsewhere.submit(lambda: asyncio.run(both())).result()
    assert ours
    assert not plain  # otherwise `ThreadSafeEvent` is no longer needed


def test_a_call_after_the_end_is_no_error() -> None:
    loop = asyncio.new_event_loop()
    event = ThreadSafeEvent(loop)
    loop.close()
    event.set()
    assert not event.is_set()

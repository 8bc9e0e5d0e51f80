"""Controls that mirror what the session has: its settings, or where its targets are."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import viser

from app.adapter.private import send_again
from app.adapter.removed_handle_errors import unless_removed
from app.client.pending_edit import HOLD, Send
from lessons.events import Event

REMIND = 2.0
"""s between two reminders of what every control must show. viser sends at most one change per 50 ms and
tab and drops all but the latest: of two controls changed at once (or while the browser stutters) one may
never arrive, and would go on showing what the session does not have."""

S = TypeVar("S")


@dataclass
class _Mirror(Generic[S]):
    handle: viser.GuiInputHandle[Any]
    read: Callable[[S], Any]
    touched: float = -float("inf")


class Bindings(Generic[S]):
    """Two ways: a control posts an event, and settings that changed otherwise (a reset, a hotkey, an event
    that was refused) move the control. Callbacks only post: they never touch the simulation.

    Controls are written on the server's event loop only. There a value that arrives from the browser and the
    callback that posts it are one piece; written from any other thread, a control could be put back between
    the two, and the callback would post the old value: the learner's edit would be lost.
    """

    def __init__(self, post: Send, loop: asyncio.AbstractEventLoop) -> None:
        """loop: the server's, on which viser handles what browsers send."""
        self.post = post
        self._loop = loop
        self._mirrors: list[_Mirror[S]] = []
        self._reminded = -float("inf")
        self._closed = False

    def bind(
        self,
        handle: viser.GuiInputHandle[Any],
        read: Callable[[S], Any],
        event: Callable[[Any], Event],
    ) -> None:
        """`read` gives the control's value for what the session has, `event` the event for a value."""
        mirror = _Mirror(handle, read)
        self._mirrors.append(mirror)

        @handle.on_update
        async def _(change: viser.GuiEvent[Any]) -> None:
            if change.client is None:
                return  # written by `refresh`
            mirror.touched = time.monotonic()
            self.post(event(on_scale(handle)))

    def refresh(self, present: S) -> None:
        """Shows what the session has. Returns at once; the event loop does it."""
        self._loop.call_soon_threadsafe(unless_removed, self._write, present)

    def close(self) -> None:
        """The controls are about to be removed: writes nothing any more."""
        self._closed = True

    def _write(self, present: S) -> None:
        if self._closed:
            return
        now = time.monotonic()
        remind = now - self._reminded > REMIND
        if remind:
            self._reminded = now
        for mirror in self._mirrors:
            if now - mirror.touched > HOLD:
                value = mirror.read(present)
                if value != mirror.handle.value:
                    mirror.handle.value = value
                elif remind:
                    send_again(mirror.handle)


def on_scale(handle: viser.GuiInputHandle[Any]) -> Any:
    """The control's value, for a slider within its ends: its number box takes any number."""
    value, low, high = handle.value, getattr(handle, "min", None), getattr(handle, "max", None)
    if not isinstance(handle, viser.GuiSliderHandle) or low is None or high is None:
        return value
    # What is not a number compares false with both ends.
    return value if low <= value <= high else high if value > high else low


def scalar(value: object) -> float:
    """A number for a slider where settings may hold one per coordinate: their mean."""
    if isinstance(value, (tuple, list)):
        return float(sum(value) / len(value))
    return float(value)  # pyright: ignore[reportArgumentType]

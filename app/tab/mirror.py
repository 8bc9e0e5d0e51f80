"""Controls that show values of the session, its settings or its targets, and edits that the session has not
yet confirmed."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import viser

from app.adapter.private import send_again, unless_removed
from lessons.events import Event

HOLD = 0.8
"""Time, s, for which a control keeps its value after it was used, because the session may not have answered
yet."""

Send = Callable[[Event], None]
"""Puts an event into the session's mailbox."""

T = TypeVar("T")


class PendingEdit(Generic[T]):
    """Stores the last edit that was sent, for the time HOLD in which the session may not have answered. A
    second key press or click in this time changes this edit, not the old value that the page still shows."""

    def __init__(self) -> None:
        self._asked: tuple[float, T] | None = None

    def ask(self, value: T) -> T:
        self._asked = (time.monotonic(), value)
        return value

    def now(self, shown: T) -> T:
        """Returns the last edit if it is recent, otherwise the value that is shown."""
        if self._asked is None or time.monotonic() - self._asked[0] > HOLD:
            return shown
        return self._asked[1]


REMIND = 2.0
"""Period, s, after which the values of all controls are sent again. viser sends at most one change per 50 ms
and tab, the latest one. If two controls change at once, or while the browser is busy, one change may be lost,
and a control would continue to show a wrong value. Also, a value that is on its way to the browser during an
edit replaces the edit on the screen. Therefore a control also sends its value again after each edit: a switch
or a menu at once, a slider or a number when it has not changed for HOLD s."""

S = TypeVar("S")


@dataclass
class _Mirror(Generic[S]):
    handle: viser.GuiInputHandle[Any]
    read: Callable[[S], Any]
    touched: float = -float("inf")
    sent: float = 0.0  # time at which the value was sent last


class Bindings(Generic[S]):
    """Bindings between controls and settings in both directions: a control posts an event, and settings that
    change in another way (a reset, a hotkey, a refused event) update the control. Callbacks only post events
    and never touch the simulation.

    Controls are written on the server's event loop only. There, nothing can run between the arrival of a
    value from the browser and the callback that posts it. Another thread could reset a control between these
    two moments. The callback would then post the old value, and the learner's edit would be lost.
    """

    def __init__(self, post: Send, loop: asyncio.AbstractEventLoop) -> None:
        """loop: the event loop of the server, on which viser handles messages of browsers."""
        self.post = post
        self._loop = loop
        self._mirrors: list[_Mirror[S]] = []
        self._reminded = self._wrote = -float("inf")
        self._written: S | None = None
        self._closed = False

    def bind(
        self, handle: viser.GuiInputHandle[Any], read: Callable[[S], Any], event: Callable[[Any], Event]
    ) -> None:
        """Binds a control. `read` returns the control's value for a state of the session, and `event` returns
        the event for a new value."""
        mirror = _Mirror(handle, read)
        self._mirrors.append(mirror)
        self._written = None

        @handle.on_update
        async def _(change: viser.GuiEvent[Any]) -> None:
            if change.client is None:
                return  # a value that `refresh` wrote
            mirror.touched = time.monotonic()
            if isinstance(handle, (viser.GuiCheckboxHandle, viser.GuiDropdownHandle)):
                send_again(handle)
                mirror.sent = mirror.touched
            self.post(event(handle.value))

    def refresh(self, present: S) -> None:
        """Shows the values of the session. Returns at once; the event loop updates the controls."""
        self._loop.call_soon_threadsafe(unless_removed, self._write, present)

    def close(self) -> None:
        """Stops all writes to the controls; called before the controls are removed."""
        self._closed = True

    def _write(self, present: S) -> None:
        if self._closed:
            return
        now = time.monotonic()
        remind = now - self._reminded > REMIND
        if remind:
            self._reminded = now
        touched = max((mirror.touched for mirror in self._mirrors), default=0.0)
        if present is self._written and not remind and self._wrote - touched > HOLD:
            return  # no setting has changed since the last write
        self._written, self._wrote = present, now
        for mirror in self._mirrors:
            if now - mirror.touched > HOLD:
                value = mirror.read(present)
                if value != mirror.handle.value:
                    mirror.handle.value = value
                    mirror.sent = now
                elif remind or mirror.sent < mirror.touched:
                    send_again(mirror.handle)
                    mirror.sent = now


def scalar(value: object) -> float:
    """Returns the number that a slider shows. If the setting has one value per coordinate, this is their
    mean."""
    if isinstance(value, (tuple, list)):
        return float(sum(value) / len(value))
    return float(value)  # pyright: ignore[reportArgumentType]

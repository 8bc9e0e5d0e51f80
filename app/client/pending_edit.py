"""Edits that the page has sent and that the session has not yet confirmed."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from lessons.events import Event

HOLD = 0.8
"""Time, s, during which a control that was just used keeps its value, because the session may not have
answered yet."""

Send = Callable[["Event"], None]
"""Puts an event into the session's mailbox."""

T = TypeVar("T")


class PendingEdit(Generic[T]):
    """The last edit that was sent, as long as the session may not have answered it. A second key press or
    click within that time changes this edit instead of the old value that the page still shows."""

    def __init__(self) -> None:
        self._asked: tuple[float, T] | None = None

    def ask(self, value: T) -> T:
        self._asked = (time.monotonic(), value)
        return value

    def now(self, shown: T) -> T:
        """The last edit if it is recent, otherwise the value that is shown."""
        if self._asked is None or time.monotonic() - self._asked[0] > HOLD:
            return shown
        return self._asked[1]

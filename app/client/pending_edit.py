"""Edits that the page has sent and that the session has not yet confirmed."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from lessons.events import Event

HOLD = 0.8
"""Time, s, for which a control keeps its value after it was used, because the session may not have answered
yet."""

Send = Callable[["Event"], None]
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

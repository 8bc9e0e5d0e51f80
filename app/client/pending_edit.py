"""What the page has asked for and not yet heard back."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from lessons.events import Event

HOLD = 0.8
"""s during which a control that was just touched is not overwritten: the session's answer is on its way."""

Send = Callable[["Event"], None]
"""Puts an event into the session's mailbox."""

T = TypeVar("T")


class PendingEdit(Generic[T]):
    """What was last asked for, as long as the session's answer may be on its way. A second key press or
    click in that time builds on the first instead of on what the page still shows."""

    def __init__(self) -> None:
        self._asked: tuple[float, T] | None = None

    def ask(self, value: T) -> T:
        self._asked = (time.monotonic(), value)
        return value

    def now(self, shown: T) -> T:
        """The wish, or what is shown if it was long ago."""
        if self._asked is None or time.monotonic() - self._asked[0] > HOLD:
            return shown
        return self._asked[1]

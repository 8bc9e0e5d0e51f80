"""Checks every message of a page, as described in `app.web.words`, before viser applies the message."""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Awaitable, Callable, Iterable
from typing import Any

import viser

from app.adapter import private
from app.adapter.removed_handle_errors import is_removed_handle_error
from app.panels.widgets.in_view import tells_what_is_seen

LONGEST = 200_000
"""Largest number of characters of a text."""
_OFTEN = 2.0  # s between two notices of one page
_GONE = "The page was rebuilt before your click or change arrived: if the control is still there, try again."


class NotAllowed(Exception):
    """A value is refused; the message says which value and why."""


def allowed(handle: viser.GuiInputHandle[Any], updates: Any) -> Any:
    """Returns the value of an update; a slider's value is limited to its range. Raises NotAllowed if the
    update changes more than the value, or if the control cannot have this value."""
    label = str(getattr(handle, "label", "") or "A control")
    if not isinstance(updates, dict) or list(updates) != ["value"]:
        raise NotAllowed(f"{label}: a page can only change the value of this control.")
    value = updates["value"]
    if isinstance(handle, viser.GuiUploadButtonHandle):
        raise NotAllowed(f"{label}: upload a file instead of writing a value.")
    options = getattr(handle, "options", None)
    if options is not None:
        if not isinstance(value, str) or value not in options:
            raise NotAllowed(f"{label}: choose one of {', '.join(map(str, options))[:300]}.")
        return value
    value = _like(handle.value, value, label)
    low, high = getattr(handle, "min", None), getattr(handle, "max", None)
    if isinstance(handle, viser.GuiSliderHandle):
        return min(max(value, low), high)
    return _within(value, low, high, label)


def _like(present: Any, value: Any, label: str) -> Any:
    """Returns the value if it has the type of the present value; raises NotAllowed otherwise."""
    match present:
        case bool():
            if isinstance(value, bool):
                return value
            raise NotAllowed(f"{label}: give True or False.")
        case int() | float():
            return _number(value, label)
        case str():
            if isinstance(value, str) and len(value) <= LONGEST:
                return value
            raise NotAllowed(f"{label}: give a text of at most {LONGEST} characters.")
        case tuple():
            if isinstance(value, (list, tuple)) and len(value) == len(present):
                return tuple(_like(old, new, label) for old, new in zip(present, value, strict=True))
            raise NotAllowed(f"{label}: give {len(present)} numbers.")
        case _:
            raise NotAllowed(f"{label}: the page cannot change this control.")


def _number(value: Any, label: str) -> int | float:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    # A whole number may be too large for a float.
    if number and abs(value) <= 1e300 and math.isfinite(value):
        return value
    raise NotAllowed(f"{label}: give a number.")


def _within(value: Any, low: Any, high: Any, label: str) -> Any:
    for one, least, most in zip(_each(value), _ends(low), _ends(high), strict=False):
        if (least is not None and one < least) or (most is not None and one > most):
            ends = [f"at least {low}"] * (low is not None) + [f"at most {high}"] * (high is not None)
            raise NotAllowed(f"{label}: give {' and '.join(ends)}.")
    return value


def _each(value: Any) -> Iterable[Any]:
    return value if isinstance(value, tuple) else (value,)


def _ends(end: Any) -> Iterable[Any]:
    return end if isinstance(end, tuple) else (end,) * 4


class Inlet:
    """Checks the messages of one page. If a control cannot have a value, the inlet refuses the value, shows a
    notice and resets the control. It also shows a notice for a press on a removed control and for an
    exception in a callback."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._next_notice = 0.0
        private.intercept(client, self._take)

    async def _take(self, message: Any, go_on: Callable[[Any], Awaitable[None]]) -> None:
        try:
            match private.kind_of(message):
                case "write":
                    await self._write(message, go_on)
                case "upload" if not private.control_of(self._client, message.source_component_uuid):
                    self.say("Not taken", _GONE)
                case _:
                    await go_on(message)
        except Exception as error:
            if is_removed_handle_error(error):
                self.say("Not taken", _GONE)
                return
            traceback.print_exc()
            self.say("That did not work", f"{type(error).__name__}: {error}"[:300])

    async def _write(self, message: Any, go_on: Callable[[Any], Awaitable[None]]) -> None:
        handle = private.control_of(self._client, message.uuid)
        if handle is None:
            if not tells_what_is_seen(message.updates):
                self.say("Not taken", _GONE)
            return
        try:
            value = allowed(handle, message.updates)
        except NotAllowed as refusal:
            self.say("Not changed", str(refusal))
            private.send_again(handle)
            return
        typed, message.updates = message.updates["value"], {"value": value}
        await go_on(message)
        if isinstance(handle, viser.GuiSliderHandle) and typed != value:
            private.send_again(handle)

    def say(self, title: str, sentence: str) -> None:
        """Shows a notice, but at most one every few seconds."""
        now = time.monotonic()
        if now >= self._next_notice:
            self._next_notice = now + _OFTEN
            self._client.add_notification(title, sentence, color="orange", auto_close_seconds=8.0)

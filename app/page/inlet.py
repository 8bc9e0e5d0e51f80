"""Checks every message of a page, as described in `app.server.words`, before viser applies the message."""

from __future__ import annotations

import time
import traceback
from collections.abc import Awaitable, Callable
from typing import Any

import viser

from app.adapter import private
from app.adapter.removed_handle_errors import is_removed_handle_error
from app.page.values import NotAllowed, allowed
from app.panels.widgets.in_view import tells_what_is_seen

_OFTEN = 2.0  # s between two notices of one page
_GONE = "The page was rebuilt before your click or change arrived: if the control is still there, try again."


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

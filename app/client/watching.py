"""The page's request for internal data of a tick, and whether the simulation has received the request."""

from __future__ import annotations

import time
from collections.abc import Callable

from app.link.inside import Inside, InsideRequest

_AGAIN = 0.4
"""Time, s, after which an unanswered request is sent again. A simulation that was restarted has lost the
request."""


class Watching:
    """Sends the request when it changes, and again while it is not answered."""

    def __init__(self, send: Callable[[InsideRequest], None]) -> None:
        self._send = send
        self._wish, self._sent_at = InsideRequest(), 0.0

    def ask(self, wish: InsideRequest, heard: Inside | None) -> None:
        """heard: the simulation's last answer."""
        now = time.monotonic()
        mute = wish != InsideRequest() and heard is None and now - self._sent_at > _AGAIN
        if wish != self._wish or mute:
            self._wish, self._sent_at = wish, now
            self._send(wish)

"""What the page wants to see of the inside of a tick, and whether the simulation knows it."""

from __future__ import annotations

import time
from collections.abc import Callable

from app.link.inside import Inside, InsideRequest

_AGAIN = 0.4
"""s after which a wish that is not answered is sent once more: a run that began anew has forgotten it."""


class Watching:
    """Sends a wish when it changes, and again while nothing comes of it."""

    def __init__(self, send: Callable[[InsideRequest], None]) -> None:
        self._send = send
        self._wish, self._sent_at = InsideRequest(), 0.0

    def ask(self, wish: InsideRequest, heard: Inside | None) -> None:
        """heard: what the simulation told last."""
        now = time.monotonic()
        mute = wish != InsideRequest() and heard is None and now - self._sent_at > _AGAIN
        if wish != self._wish or mute:
            self._wish, self._sent_at = wish, now
            self._send(wish)

"""Commands on their way to a simulation: whoever gives one never waits, and nothing piles up without end."""

from __future__ import annotations

import threading
from collections import deque

from app.link.wire import Parcel, Wire, packed

MOST = 256
"""Commands that may wait."""
MOST_BYTES = 24_000_000
"""Bytes that may wait; one command is always taken."""


class Outbox:
    """A bounded queue and the one thread that writes to the wire."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._waiting: deque[Parcel] = deque()
        self._bytes = 0
        self._closed = False
        self._news = threading.Condition()
        self._writer = threading.Thread(target=self._write, daemon=True)
        self._writer.start()

    def put(self, message: object) -> bool:
        """Whether there was room."""
        parcel = packed(message)
        with self._news:
            full = len(self._waiting) >= MOST or self._bytes + len(parcel.content) > MOST_BYTES
            if self._closed or (full and self._waiting):
                return False
            self._waiting.append(parcel)
            self._bytes += len(parcel.content)
            self._news.notify()
            return True

    def close(self) -> None:
        """What still waits is forgotten."""
        with self._news:
            self._closed = True
            self._waiting.clear()
            self._news.notify()

    def join(self) -> None:
        """Waits until nothing is written any more: after `close`, and once the wire hangs up."""
        self._writer.join()

    def _write(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                parcel = self._waiting.popleft()
                self._bytes -= len(parcel.content)
            try:
                self._wire.post(parcel)
            except OSError:
                return  # nobody reads any more; whoever listens hears of it

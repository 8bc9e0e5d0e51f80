"""A bounded queue of commands to a simulation. Adding a command never waits."""

from __future__ import annotations

import threading
from collections import deque

from app.link.wire import Parcel, Wire, packed

MOST = 256
"""Largest number of commands in the queue."""
MOST_BYTES = 24_000_000
"""Largest number of bytes in the queue. If the queue is empty, a command of any size is accepted."""


class Outbox:
    """A bounded queue, and the only thread that writes from this queue to the wire."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._waiting: deque[Parcel] = deque()
        self._bytes = 0
        self._closed = False
        self._news = threading.Condition()
        self._writer = threading.Thread(target=self._write, daemon=True)
        self._writer.start()

    def put(self, message: object) -> bool:
        """Adds a command; returns whether there was room for it."""
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
        """Discards all commands that still wait."""
        with self._news:
            self._closed = True
            self._waiting.clear()
            self._news.notify()

    def join(self) -> None:
        """Waits until the thread has stopped writing. Call this after `close`, when the connection has been
        ended."""
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
                return  # the receiver has closed its end; the receiving thread handles this

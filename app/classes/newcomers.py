"""A limit on the number of phones that join a class from one address."""

from __future__ import annotations

import time
from collections.abc import Callable

PER_MINUTE = 400
"""Largest number of new phones from one address in a minute: a whole lecture hall may be behind one
address."""
ADDRESSES = 1000
"""Largest number of addresses that are remembered; those that have been silent longest are forgotten."""


class Newcomers:
    """Counts the phones that join, by address. An unknown address (behind a proxy) counts as one address."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """clock: returns the time, s."""
        self._clock = clock
        self._joined: dict[str | None, tuple[float, int]] = {}  # begin of the minute, and the number since

    def admit(self, address: str | None) -> bool:
        """Counts one more phone; returns whether it may join now."""
        now = self._clock()
        since, number = self._joined.pop(address, (now, 0))
        if now - since >= 60.0:
            since, number = now, 0
        self._joined[address] = since, min(number + 1, PER_MINUTE + 1)
        if len(self._joined) > ADDRESSES:
            del self._joined[next(iter(self._joined))]
        return number < PER_MINUTE

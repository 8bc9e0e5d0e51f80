"""Limits on the number of connections. If there is no room for a new connection, the oldest connection that
has sent no valid message is closed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

TOTAL = 256
PER_ADDRESS = 96
"""Largest number of connections from one address: enough for two connections per learner of a class
behind one address."""

OF_A_CLASS = 1000, 800
"""TOTAL and PER_ADDRESS for a class, whose phones may all be behind one address."""


@dataclass
class _Guest:
    address: str | None
    leave: Callable[[], object]
    spoke: bool = False


class ConnectionLimits:
    """The open connections, oldest first. A key identifies each connection."""

    def __init__(self, total: int = TOTAL, per_address: int = PER_ADDRESS) -> None:
        self._total, self._per_address = total, per_address
        self._guests: dict[object, _Guest] = {}

    def __len__(self) -> int:
        return len(self._guests)

    def enter(self, key: object, address: str | None, leave: Callable[[], object]) -> bool:
        """Adds a connection; returns whether there was room. address: None if unknown (behind a proxy).
        leave: closes the connection."""
        if not self._room(self._total, lambda _: True):
            return False
        self._guests[key] = _Guest(None, leave)
        if self.comes_from(key, address):
            return True
        del self._guests[key]
        return False

    def comes_from(self, key: object, address: str | None) -> bool:
        """Stores the address of a connection; returns whether there was room for another connection from this
        address."""
        guest = self._guests.get(key)
        if guest is None:
            return False
        if address is None or guest.address == address:
            return True
        if not self._room(self._per_address, lambda other: other.address == address):
            return False
        guest.address = address
        return True

    def _room(self, most: int, counts: Callable[[_Guest], bool]) -> bool:
        inside = {key: guest for key, guest in self._guests.items() if counts(guest)}
        if len(inside) < most:
            return True
        for key, guest in inside.items():
            if not guest.spoke:
                del self._guests[key]
                guest.leave()
                return True
        return False

    def spoke(self, key: object) -> None:
        """Notes that this connection has sent a valid message. It will not be closed to make room for
        others."""
        guest = self._guests.get(key)
        if guest is not None:
            guest.spoke = True

    def has_spoken(self, key: object) -> bool:
        guest = self._guests.get(key)
        return guest is not None and guest.spoke

    def leave(self, key: object) -> None:
        self._guests.pop(key, None)

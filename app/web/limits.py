"""Limits for connections: their number, their rates of messages and bytes, and the size of incomplete
uploads. If there is no room for a new connection, the oldest one that has sent no valid message is closed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import msgspec

MESSAGES = 200.0
"""Largest rate of messages, 1/s. A page sends each group of controls, each gizmo and the camera at most 20 to
50 times per second. If all of them are moved at the same time, it sends fewer than 100 messages per
second."""
BURST = 400.0
BYTES = 4e6
"""Largest rate of bytes, B/s. BYTES_BURST is the largest burst, B."""
BYTES_BURST = 24e6
UPLOADS = 10_000_000
"""Largest total size of incomplete uploads, B."""
MESSAGE = 12 * 2**20
"""Largest size of a message, B."""
PATIENCE = 10.0
"""Time, s, for which a connection may exceed its limits without a pause."""
CONTROL_FRAMES = 20.0
"""Largest rate of control frames such as pings, 1/s. Pages send no control frames; client programs send one
every 20 s."""
WAITING = 2000
"""Largest number of frames that wait to be processed."""
_ENTRY = 1024  # B of memory for each part of an upload, in addition to its content


@dataclass
class Bucket:
    """A token bucket that fills at `rate` up to `size`. Its content may become negative."""

    rate: float
    size: float
    now: Callable[[], float]
    left: float = field(init=False)
    at: float = field(init=False)

    def __post_init__(self) -> None:
        self.left, self.at = self.size, self.now()

    def take(self, amount: float) -> float:
        """Takes an amount; returns the time, s, until the content is no longer negative."""
        now = self.now()
        self.left = min(self.size, self.left + self.rate * (now - self.at)) - amount
        self.at = now
        return max(0.0, -self.left / self.rate)


class Budget:
    """The limits of one connection. The limits do not depend on the content of messages."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._messages = Bucket(MESSAGES, BURST, now)
        self._bytes = Bucket(BYTES, BYTES_BURST, now)
        self._control = Bucket(CONTROL_FRAMES, 2 * CONTROL_FRAMES, now)
        self._held = 0
        self._calm = now()

    def wait(self, size: int) -> float:
        """Returns the time, s, to wait before a message of `size` bytes is processed. A connection that sends
        too much is thus read more slowly."""
        waiting = max(self._messages.take(1.0), self._bytes.take(float(size)))
        if not waiting:
            self._calm = self._now()
        return waiting

    @property
    def spent(self) -> bool:
        """Whether the connection has exceeded its limits for too long."""
        return self._now() - self._calm > PATIENCE

    def controls(self) -> bool:
        """Returns whether one more ping may be answered."""
        return not self._control.take(1.0)

    def uploads(self, size: int, unfinished: Callable[[], int]) -> bool:
        """Returns whether a part of `size` bytes may be accepted. unfinished: returns the number of bytes of
        incomplete files."""
        if self._held + size + _ENTRY > UPLOADS:
            self._held = unfinished()  # files that are complete now no longer count
        if self._held + size + _ENTRY > UPLOADS:
            return False
        self._held += size + _ENTRY
        return True


TRANSFER = b"FileTransfer"
"""Every message that begins or carries a file contains these bytes."""
_REMEMBERED = 64  # number of refused uploads that are stored, since parts of them may still arrive


class _Transfer(msgspec.Struct):
    """The decoded fields of an upload message, without the file's bytes."""

    transfer_uuid: str = ""
    size_bytes: int = 0


class Uploads:
    """The uploads of one page.

    Args:
        unfinished: returns the number of bytes of the page's incomplete files.
        forget: discards the received parts of a file.
        say: shows the user that a file was too large.
    """

    def __init__(
        self, unfinished: Callable[[], int], forget: Callable[[str], None], say: Callable[[], None]
    ) -> None:
        self._unfinished, self._forget, self._say = unfinished, forget, say
        self._refused: deque[str] = deque(maxlen=_REMEMBERED)

    def takes(self, raw: bytes, budget: Budget) -> bool:
        """Returns whether a message that begins or carries a file may be passed on."""
        try:
            part = msgspec.msgpack.decode(raw, type=_Transfer)
        except msgspec.DecodeError:
            part = _Transfer()
        if part.transfer_uuid in self._refused:
            return False
        if part.size_bytes <= UPLOADS and budget.uploads(len(raw), self._unfinished):
            return True
        self._refused.append(part.transfer_uuid)
        self._forget(part.transfer_uuid)
        self._say()
        return False


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

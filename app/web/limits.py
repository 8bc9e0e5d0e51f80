"""Limits for connections: their number, their rates of messages and bytes, the size of incomplete uploads,
and wrong codes at the phones' address of a class. If there is no room for a new connection, the oldest one
that has sent no valid message is closed. After some wrong codes from an address, its answers are late."""

from __future__ import annotations

import contextlib
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
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


FREE = 20
"""Number of different wrong codes from one address after which its answers are late. A phone of an earlier
class repeats one code, and counts once."""
DELAY = 2.0
"""Time, s, by which answers are late: right and wrong ones, as a fast answer would be a right one."""
MOST_LATE = 50
"""Largest number of answers to one address that wait at the same time. Further requests are refused."""
FORGET = 600.0
"""Time, s, after the last new wrong code from an address until the address is forgotten."""
ADDRESSES = 1000
"""Largest number of addresses that are remembered; those that have been silent longest are forgotten."""


@dataclass
class _Guesses:
    at: float
    codes: set[str] = field(default_factory=set)
    waiting: int = 0


class WrongCodes:
    """The addresses that sent wrong codes. An unknown address (behind a proxy) counts as one address."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """clock: returns the time, s."""
        self._clock = clock
        self._guesses: dict[str | None, _Guesses] = {}

    def note(self, address: str | None, code: str) -> None:
        """Counts a wrong code. Says on the terminal when there are too many from one address."""
        guesses = self._guesses_of(address) or _Guesses(self._clock())
        self._guesses.pop(address, None)
        self._guesses[address] = guesses  # the last one is forgotten last
        if len(self._guesses) > ADDRESSES:
            del self._guesses[next(iter(self._guesses))]
        known = len(guesses.codes)
        if known <= FREE:
            guesses.codes.add(code[:32])
        if code[:32] not in guesses.codes or len(guesses.codes) > known:
            guesses.at = self._clock()
        if known == FREE < len(guesses.codes):
            print(_SAYS.format(FREE, _plain(address), DELAY), file=sys.stderr, flush=True)

    def are_many(self, address: str | None) -> bool:
        """Returns whether answers to this address must be late."""
        guesses = self._guesses_of(address)
        return guesses is not None and len(guesses.codes) > FREE

    @contextlib.contextmanager
    def waits(self, address: str | None) -> Iterator[bool]:
        """Counts an answer that waits within this context. The context's value is whether it may wait."""
        guesses = self._guesses_of(address)
        if guesses is None:
            yield True
            return
        guesses.waiting += 1
        try:
            yield guesses.waiting <= MOST_LATE
        finally:
            guesses.waiting -= 1

    def _guesses_of(self, address: str | None) -> _Guesses | None:
        guesses = self._guesses.get(address)
        return None if guesses is None or self._clock() - guesses.at > FORGET else guesses


_SAYS = (
    "himpc-lab: {1} sent more than {0} different wrong codes of the class: somebody may be guessing. "
    "Answers to phones that open their page from there now take {2:g} s."
)


def _plain(address: str | None) -> str:
    return "an unknown address" if address is None else "".join(filter(str.isprintable, address))

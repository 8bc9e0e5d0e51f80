"""Limits for one connection: rates of messages and bytes, and the size of incomplete uploads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

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

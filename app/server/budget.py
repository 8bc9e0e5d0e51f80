"""What one connection may cost: messages, bytes, and files that are not complete."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

MESSAGES = 200.0
"""1/s. A page sends each group of controls, each gizmo and the camera at most 20 to 50 times a second; one
that is dragged and turned with everything at once stays below 100."""
BURST = 400.0
BYTES = 4e6
"""B/s, and so many at once:"""
BYTES_BURST = 24e6
UPLOADS = 10_000_000
"""B of files that are not complete."""
MESSAGE = 12 * 2**20
"""B, the longest message."""
PATIENCE = 10.0
"""s without a pause in which a connection asks for more than it may."""
CONTROL_FRAMES = 20.0
"""1/s: pings and the like. Pages send none; a program sends one in 20 s."""
WAITING = 2000
"""Frames that wait to be taken."""
_ENTRY = 1024  # B that an upload costs beside what it holds


@dataclass
class Bucket:
    """Fills at `rate`, holds `size`. What is taken is there at once or owed; debts are paid by waiting."""

    rate: float
    size: float
    now: Callable[[], float]
    left: float = field(init=False)
    at: float = field(init=False)

    def __post_init__(self) -> None:
        self.left, self.at = self.size, self.now()

    def take(self, amount: float) -> float:
        """s to wait until what was taken is paid for."""
        now = self.now()
        self.left = min(self.size, self.left + self.rate * (now - self.at)) - amount
        self.at = now
        return max(0.0, -self.left / self.rate)


class Budget:
    """Of one connection. Nothing in here looks into a message."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._messages = Bucket(MESSAGES, BURST, now)
        self._bytes = Bucket(BYTES, BYTES_BURST, now)
        self._control = Bucket(CONTROL_FRAMES, 2 * CONTROL_FRAMES, now)
        self._held = 0
        self._calm = now()

    def wait(self, size: int) -> float:
        """s before a message of so many bytes may be handled: who sends too much is read more slowly."""
        waiting = max(self._messages.take(1.0), self._bytes.take(float(size)))
        if not waiting:
            self._calm = self._now()
        return waiting

    @property
    def spent(self) -> bool:
        """It has been asking for too much for too long."""
        return self._now() - self._calm > PATIENCE

    def controls(self) -> bool:
        """Whether one more ping may be answered."""
        return not self._control.take(1.0)

    def uploads(self, size: int, unfinished: Callable[[], int]) -> bool:
        """Whether a part of so many bytes may be taken. unfinished: what files hold that are not complete."""
        if self._held + size + _ENTRY > UPLOADS:
            self._held = unfinished()  # files that were complete since then hold nothing more
        if self._held + size + _ENTRY > UPLOADS:
            return False
        self._held += size + _ENTRY
        return True

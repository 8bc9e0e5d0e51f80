"""Wrong codes at the phones' address of a class, counted by address. After some of them, answers are late."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

FREE = 20
"""Number of different wrong codes from one address after which its answers are late. A phone of an earlier
class repeats one code, and counts once."""
DELAY = 2.0
"""Time, s, by which answers are late: right and wrong ones, as a fast answer would be a right one."""
WAITING = 50
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
            yield guesses.waiting <= WAITING
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

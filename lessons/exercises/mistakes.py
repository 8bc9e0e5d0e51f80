"""Finds the known mistake of a submission: the one that returns the same torques at every state shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, final

import numpy as np

from himpc.controllers.view import View

Law = Callable[[View], Any]
CLOSE = 1e-6
"""Share of the largest torque by which the torques of two laws that count as equal may differ."""
_FIRST, _EVERY = 30, 10


@dataclass(frozen=True)
class Mistake:
    """A frequent mistake.

    Attributes:
        says: one sentence about it.
        make: returns a new control law with this mistake, without memory of earlier runs.
        text: the file of a student who makes it; "" for the lab's own, which are laws.
    """

    says: str
    make: Callable[[], Law]
    text: str = ""


@final
class Diagnosis:
    """The known mistakes whose torques have been equal to those of a submission so far."""

    def __init__(self, mistakes: Sequence[Mistake]) -> None:
        self._left = list(mistakes)
        self._laws: list[Law] = []
        self._seen = 0

    def begin(self) -> None:
        """Called when a run begins."""
        self._laws, self._seen = [each.make() for each in self._left], 0

    def see(self, now: View, answer: Any) -> None:
        """Compares the torque of a submission at a tick: at the first ticks of a run, then at every tenth."""
        self._seen += 1
        if self._seen > _FIRST and self._seen % _EVERY:
            return
        alike = [_alike(law(now), answer) for law in self._laws]
        self._left = [each for each, same in zip(self._left, alike, strict=True) if same]
        self._laws = [each for each, same in zip(self._laws, alike, strict=True) if same]

    @property
    def says(self) -> str:
        """The sentence of the first mistake that fits all compared torques; "" if none fits."""
        return self._left[0].says if self._left else ""


def _alike(ours: Any, theirs: Any) -> bool:
    try:
        here, there = np.atleast_2d(np.asarray(ours, float))[-1], np.atleast_2d(np.asarray(theirs, float))[-1]
        return bool(np.abs(here - there).max() <= CLOSE * (1.0 + np.abs(here).max()))
    except (TypeError, ValueError):
        return False


def wrong(says: str, law: Callable[..., Any], **how: Any) -> Mistake:
    """A mistake as the control law `law` with the arguments `how`."""
    return Mistake(says, lambda: partial(law, **how))

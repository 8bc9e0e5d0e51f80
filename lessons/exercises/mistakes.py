"""Finds the known mistake whose torques are equal to those of a submission at all compared states."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from himpc.controllers.view import View

Law = Callable[[View], Any]
CLOSE = 1e-6
"""Largest difference of two torques that count as equal, as a share of the largest torque."""
_FIRST, _EVERY = 30, 10


@dataclass(frozen=True)
class Mistake:
    """A frequent mistake.

    Attributes:
        says: the sentence that names the mistake.
        make: returns a new control law with this mistake, without memory of earlier runs.
        text: a student's file with this mistake; "" for the mistakes of the lab's own exercises.
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
        """Prepares the comparison for a new run."""
        self._laws, self._seen = [mistake.make() for mistake in self._left], 0

    def see(self, now: View, answer: Any) -> None:
        """Compares the torque of a submission with those of the mistakes. After the first ticks of a run,
        only every tenth tick is compared."""
        self._seen += 1
        if self._seen > _FIRST and self._seen % _EVERY:
            return
        alike = [_alike(law(now), answer) for law in self._laws]
        self._left = [mistake for mistake, same in zip(self._left, alike, strict=True) if same]
        self._laws = [law for law, same in zip(self._laws, alike, strict=True) if same]

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

"""What a learner has done so far, as the browser keeps it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from lessons.course import COURSE


@dataclass(frozen=True)
class Progress:
    """Attributes:
    seen: per lesson the places of the steps whose run was seen.
    best: per lesson the best points (0 to 100) of its challenge.
    """

    seen: Mapping[str, frozenset[int]] = field(default_factory=dict)
    best: Mapping[str, float] = field(default_factory=dict)

    def with_step(self, lesson: str, place: int) -> Progress:
        """After a step's run."""
        return replace(self, seen={**self.seen, lesson: self.seen.get(lesson, frozenset()) | {place}})

    def with_points(self, lesson: str, points: float) -> Progress:
        """After a challenge that was passed; only the best attempt counts."""
        return replace(self, best={**self.best, lesson: max(points, self.best.get(lesson, 0.0))})

    def next_place(self, lesson: str, steps: int) -> int:
        """The first step not seen yet; 0 if all were."""
        seen = self.seen.get(lesson, frozenset())
        return next((place for place in range(steps) if place not in seen), 0)

    def dumped(self) -> str:
        """As text."""
        return json.dumps(
            {"seen": {name: sorted(places) for name, places in self.seen.items()}, "best": dict(self.best)}
        )


def progress_from(text: str | None) -> Progress:
    """From the browser's storage, which anybody may have written: what makes no sense is left out."""
    try:
        found = json.loads(text or "{}")
    except (ValueError, RecursionError):
        return Progress()
    if not isinstance(found, dict):
        return Progress()
    return Progress(
        {
            name: frozenset(place for place in places if type(place) is int and 0 <= place < 100)
            for name, places in _of_lessons(found.get("seen"))
            if isinstance(places, list)
        },
        {
            name: float(points)
            for name, points in _of_lessons(found.get("best"))
            if type(points) in (int, float) and math.isfinite(points) and 0 <= points <= 100
        },
    )


def _of_lessons(found: Any) -> list[tuple[str, Any]]:
    return [(name, found[name]) for name in COURSE if name in found] if isinstance(found, dict) else []


class Notebook:
    """The progress of the learner at this page, written down whenever it grows."""

    def __init__(self, progress: Progress, save: Callable[[str], None]) -> None:
        self.progress = progress
        self._save = save

    def note(self, progress: Progress) -> None:
        if progress != self.progress:
            self.progress = progress
            self._save(progress.dumped())

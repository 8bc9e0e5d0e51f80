"""Sentences about the latest events, for people who use a screen reader."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from app.html.text import joints_named, quantity

if TYPE_CHECKING:  # for types only, as the server listens before it loads modules that compute
    from app.panels.widgets.snapshot import SessionSnapshot
    from lessons.settings.settings import SceneSettings

AT_MOST_EVERY = 2.0
"""Time, s, between two sentences."""
_STEADY = 0.1
"""An error counts as steady if it changes by less than this share between two checks."""
_WORTH = 2.0
"""An error is announced again if it has changed by at least this factor."""
_SMALL = {"m": 1e-3, "rad": math.radians(0.5)}
"""Errors below this value count as equal."""
_QUIET = 10.0
"""Time, s, during which the same active limit is not announced again."""
_GUARD = "lexicographic"
"""The kind of the rows of (11) and (12). One of them binds in almost every period; they are not announced."""


@dataclass(frozen=True)
class Facts:
    """The state of a session at one check.

    Attributes:
        running: whether simulated time passes.
        resets: number of resets so far.
        levels: (name, whether it is on), highest priority first.
        errors: for each task its error and the unit, m or rad.
        limits: active limits, as (kind, joint).
    """

    running: bool
    resets: int
    levels: tuple[tuple[str, bool], ...]
    errors: dict[str, tuple[float, str]]
    limits: frozenset[tuple[str, str]]


def facts_of(now: SessionSnapshot[SceneSettings]) -> Facts:
    """Returns the facts of a snapshot."""
    status = now.status
    fields = now.ready.layout.fields
    return Facts(
        status.running,
        status.resets,
        tuple((level.name, level.enabled) for level in now.settings.levels),
        {
            task.name: (now.error(task.name), task.unit)
            for task in now.ready.tasks
            if f"error/{task.name}" in fields
        },
        frozenset((each.kind, each.joint) for each in status.binding),
    )


class Narration:
    """Compares each check with the previous one, and collects sentences until the next announcement."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """clock: returns the time, s."""
        self._clock = clock
        self._before: Facts | None = None
        self._told: dict[str, float] = {}
        self._limits: dict[tuple[str, str], float] = {}
        self._waiting: list[str] = []
        self._next = -math.inf

    def look(self, now: Facts) -> str:
        """Returns the sentence that is due, with all events since the last sentence; "" if no sentence is
        due."""
        before, self._before = self._before, now
        if before is None:
            self._told = {name: error for name, (error, _) in now.errors.items() if math.isfinite(error)}
            self._waiting += [] if now.running else ["paused"]
        else:
            for sentence in (*_switched(before, now), *self._reached(now), *self._arrived(before, now)):
                if sentence not in self._waiting:
                    self._waiting.append(sentence)
        if not self._waiting or self._clock() < self._next:
            return ""
        self._next = self._clock() + AT_MOST_EVERY
        said = joints_named("; ".join(self._waiting[-4:]))
        self._waiting.clear()
        return said[0].upper() + said[1:] + "."

    def _reached(self, now: Facts) -> list[str]:
        """Returns active limits that were not announced recently."""
        t = self._clock()
        limits = sorted(each for each in now.limits if each[0] != _GUARD)
        new = [each for each in limits if t - self._limits.get(each, -math.inf) > _QUIET]
        self._limits.update(dict.fromkeys(now.limits, t))
        return [f"{kind} limit of {joint} is met" for kind, joint in new]

    def _arrived(self, before: Facts, now: Facts) -> list[str]:
        """Steady errors that differ from the last announced errors."""
        found = []
        for name, (error, unit) in now.errors.items():
            was, least = before.errors.get(name, (math.nan, unit))[0], _SMALL.get(unit, 0.0)
            told = self._told.setdefault(name, error) if math.isfinite(error) else error
            if not abs(error - was) <= max(_STEADY * was, 0.1 * least):
                continue
            if max(error, least) > _WORTH * max(told, least) or max(told, least) > _WORTH * max(error, least):
                self._told[name] = error
                found.append(f"{name} {quantity(error, unit)} from its target")
        return found


def _switched(before: Facts, now: Facts) -> list[str]:
    found = []
    if now.resets != before.resets:
        found.append("robot back at its start")
    if now.running != before.running:
        found.append("running" if now.running else "paused")
    was = dict(before.levels)
    for place, (name, on) in enumerate(now.levels, start=1):
        if was.get(name, on) != on:
            found.append(f"level {place}, {name}, switched {'on' if on else 'off'}")
    if [name for name, _ in now.levels] != [name for name, _ in before.levels]:
        found.append("the levels are now " + ", ".join(name for name, _ in now.levels))
    return found

"""The order in which the robots of a class are built for its next step."""

from __future__ import annotations

from collections.abc import Collection

PATIENCE = 10.0
"""Time, s, after which the next robot no longer waits for a robot that is not ready."""


class BuildQueue:
    """The learners who wait for a robot at the class's step, and those whose robot is being built."""

    def __init__(self, at_once: int) -> None:
        """at_once: the number of robots that are built at the same time."""
        self._at_once = at_once
        self._waiting: list[str] = []
        self._building: dict[str, float] = {}  # time at which the building began, s

    def clear(self) -> None:
        """Removes all learners who wait. Learners whose robots are being built for an earlier step of the
        class remain in the queue, at its start."""
        self._waiting, self._building = list(self._building), {}

    def enter(self, who: str) -> None:
        """Adds a learner at the end of the queue."""
        self._building.pop(who, None)
        self._waiting.append(who)

    def leave(self, who: str) -> None:
        """Removes a learner who has left."""
        self._building.pop(who, None)
        if who in self._waiting:
            self._waiting.remove(who)

    def has(self, who: str) -> bool:
        """Returns whether a learner waits for a robot to be built or to become ready."""
        return who in self._building or who in self._waiting

    def next(self, ready: Collection[str], now: float) -> list[str]:
        """Returns the learners whose robots must be built now. ready: the learners whose robots are at the
        class's step; now: the time, s."""
        self._building = {
            who: since for who, since in self._building.items() if who not in ready and now - since < PATIENCE
        }
        room = max(0, self._at_once - len(self._building))
        chosen, self._waiting = self._waiting[:room], self._waiting[room:]
        self._building |= dict.fromkeys(chosen, now)
        return chosen

    def before(self) -> dict[str, int]:
        """Returns, for each learner in the queue, the number of learners before them; 0 while their robot is
        being built."""
        return {
            **dict.fromkeys(self._building, 0),
            **{who: len(self._building) + k for k, who in enumerate(self._waiting)},
        }

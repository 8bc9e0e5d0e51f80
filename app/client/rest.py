"""Pauses the robot of a learner in a class when the robot's run is over and the learner does nothing."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, final

from app.link.messages import Command, Play, Post

if TYPE_CHECKING:
    from app.link.exercise import Lecture
    from app.link.messages import Status

AFTER = 5.0
"""Time, s, from the end of a run or the learner's last action until the robot is paused."""


@final
class Rest:
    """Whether a robot is paused. The robot continues when its learner moves or changes anything."""

    def __init__(self) -> None:
        self._since = time.monotonic()
        self._rests = False

    def stir(self) -> None:
        """Called while a run makes progress."""
        self._since = time.monotonic()

    def wakes(self, command: Command) -> bool:
        """Notes a command of the learner; returns whether the robot must continue before it gets this
        command."""
        if not isinstance(command, Post | Play):
            return False
        kept = isinstance(command, Play) and command.running  # the learner wants to see the robot move
        self._since = math.inf if kept else max(self._since, time.monotonic())
        woken, self._rests = self._rests and isinstance(command, Post), False
        return woken

    def begins(self, lecture: Lecture | None, status: Status | None) -> bool:
        """Returns whether the robot must be paused now. lecture, status: the last reports."""
        over = lecture is not None and lecture.phase == "done" and status is not None and status.running
        self._rests = self._rests or (over and time.monotonic() - self._since > AFTER)
        return self._rests and over

"""A robot in a class: the class's step before the robot has loaded it, and the pause after its run."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, final

from app.link.exercise import Lecture, LessonPlace, Predict, RunStep
from app.link.messages import Command, Play, Post
from robots import InputError

if TYPE_CHECKING:
    from app.link.messages import Status
    from lessons.settings.settings import SceneSettings

AFTER = 5.0
"""Time, s, from the end of a run or the learner's last action until the robot is paused."""


@final
@dataclass(frozen=True)
class Coming:
    """A step that a page shows before the robot has loaded it.

    Attributes:
        lecture: the step before its run, with the prediction that the learner made meanwhile.
        held: the learner's commands at this step; they are sent to the robot when it loads the step.
        sent: whether the robot has received the command to load the step.
    """

    lecture: Lecture
    held: tuple[Predict | RunStep, ...] = ()
    sent: bool = False

    @classmethod
    def at(cls, place: LessonPlace, settings: SceneSettings | None) -> Coming | None:
        """Returns the step before any command; None if its controls cannot be built from the present
        settings. Raises InputError if there is no such step."""
        from lessons.teaching.lesson import Step

        part = place.part
        if settings is None:
            return None
        try:
            for control in part.controls if isinstance(part, Step) else part.knobs:
                settings.value_at(control.path)
        except InputError:
            return None
        return cls(Lecture(place, "waiting", attempt=0, t=0.0, duration=part.duration))

    def after(self, command: Predict | RunStep) -> Coming:
        """Returns the same step after the learner made a prediction or pressed Run."""
        held = self.held if self.sent else (*self.held, command)
        if isinstance(command, Predict):
            return replace(self, lecture=replace(self.lecture, answer=command.answer), held=held)
        return replace(self, held=held)

    def sent_to(self, place: LessonPlace | None) -> Coming | None:
        """Returns the same step after the robot received the command to load the step `place`; None if
        `place` is another step."""
        return replace(self, held=(), sent=True) if place == self.lecture.exercise else None

    def is_at(self, lecture: Lecture) -> bool:
        """Returns whether a report comes from a robot that has loaded this step."""
        return self.sent and lecture.exercise == self.lecture.exercise


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

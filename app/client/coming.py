"""The class's step as a page shows it while the robot has not loaded this step yet."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, final

from app.link.exercise import Lecture, LessonPlace, Predict, RunStep
from robots import InputError

if TYPE_CHECKING:
    from lessons.settings.settings import SceneSettings


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

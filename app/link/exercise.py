"""The active step of a lesson, and the state of its run, as frozen and picklable data."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from lessons.course import load_lesson
from lessons.own.files import Source, is_lesson, read
from robots import InputError

if TYPE_CHECKING:
    from lessons.scenes.run_spec import RunSpec
    from lessons.teaching.lesson import Challenge, Lesson, Result, Step
    from lessons.teaching.measure import Signal
    from lessons.teaching.prediction import PredictionResult

Answer = int | float | tuple[tuple[float, float], ...]
"""A prediction: the index of an option, a value, or the points (t in s, value) of a sketch."""

Phase = Literal["waiting", "preparing", "running", "done"]
"""Before the run ("waiting"); while the ghost is computed ("preparing"); while the script runs ("running");
after the run, when the robot can be moved freely ("done")."""


@dataclass(frozen=True)
class LessonPlace:
    """A step of a lesson. The place after the last step is the lesson's challenge.

    Attributes:
        lesson: name of the lesson, or path of the user's own file.
        place: number of the step, 0-based.
        text: the text of the user's own file when the lesson was opened. The page shows this version until a
            sound one is saved.
    """

    lesson: str
    place: int = 0
    text: str | None = None

    @classmethod
    def at(cls, lesson: str, step: int) -> LessonPlace:
        """Returns a step by its number; 1 is the first step. Raises InputError if there is no such lesson or
        step."""
        count = len(parts_of(cls(lesson).whole))
        if not 1 <= step <= count:
            raise InputError(f"lesson '{lesson}' has no step {step}: choose one from 1 to {count}")
        return cls(lesson, step - 1)

    @property
    def opened(self) -> LessonPlace:
        """The same place with the text of the user's file as it is now. Raises InputError if it cannot be
        read."""
        return replace(self, text=read(self.lesson).text) if is_lesson(self.lesson) else self

    @property
    def whole(self) -> Lesson:
        """The whole lesson. Raises InputError for an unknown or wrong lesson."""
        if not is_lesson(self.lesson):
            return load_lesson(self.lesson)
        from lessons.authoring.lesson import lesson_of

        return lesson_of(read(self.lesson) if self.text is None else Source(self.lesson, self.text))

    @property
    def part(self) -> Step | Challenge:
        lesson = self.whole
        parts = parts_of(lesson)
        return parts[min(max(self.place, 0), len(parts) - 1)]

    @property
    def run(self) -> RunSpec:
        return self.whole.run_of(self.part)


@dataclass(frozen=True)
class Predict:
    """Command: the learner's prediction of what the run of a step will show."""

    answer: Answer


@dataclass(frozen=True)
class RunStep:
    """Command: run a step's script from its start. own: use the lesson's settings instead of the learner's
    (a challenge always uses the learner's); fast: run as fast as possible."""

    own: bool = True
    fast: bool = False


def parts_of(lesson: Lesson) -> tuple[Step | Challenge, ...]:
    """Returns the steps of a lesson, and its challenge if it has one."""
    return lesson.steps if lesson.challenge is None else (*lesson.steps, lesson.challenge)


def signals_of(part: Step | Challenge) -> tuple[Signal, ...]:
    """Returns the signals to plot during the run."""
    from lessons.teaching.lesson import Step

    if isinstance(part, Step):
        return part.plots
    return tuple(dict.fromkeys(measure.signal for measure in part.measures))


@dataclass(frozen=True, eq=False)
class SignalCurve:
    """A signal over the run so far: t (k,) s, values (k,) in the signal's unit. The curve is decimated, but
    keeps every peak."""

    t: np.ndarray
    values: np.ndarray


@dataclass(frozen=True, eq=False)
class Lecture:
    """The state of an exercise.

    Attributes:
        exercise: the exercise.
        phase: see `Phase`.
        attempt: number of runs since the exercise was opened.
        t: time up to which the claims have been evaluated, s; duration: length of the run, s.
        answer: the learner's prediction.
        changed: one sentence if the run differs from the lesson's own run (other settings, or the learner
            interfered); otherwise "".
        values: measured value per claim or goal; NaN before there is a measurement.
        holds: whether each claim or goal holds so far; None before there is a measurement.
        truth: the measured value of the predicted quantity.
        grade: the grade of the prediction, after the run.
        curves: one curve per signal of the step; ghosts: the same for the second robot, if its run was
            computed.
        sketched: the curve that a sketch predicts.
        result, points_for: the result of a challenge and the value that decides its points; both are
            known after the run.
        lost_at: time at which the robot went out of control, s; the run ends there.
    """

    exercise: LessonPlace
    phase: Phase
    attempt: int
    t: float
    duration: float
    answer: Answer | None = None
    changed: str = ""
    values: tuple[float, ...] = ()
    holds: tuple[bool | None, ...] = ()
    truth: float = float("nan")
    grade: PredictionResult | None = None
    curves: tuple[SignalCurve, ...] = ()
    ghosts: tuple[SignalCurve, ...] = ()
    sketched: SignalCurve | None = None
    result: Result | None = None
    points_for: float = float("nan")
    lost_at: float | None = None

"""Explanations are tested by intervention: when the cause is removed, the effect must disappear.

Each row quotes a sentence and names a run that shows the effect, the assignments that remove the cause, and
the measured values with and without it. `interventions_all` contains all rows: those of the course are in
`interventions_tasks`, `interventions_limits` and `interventions_mobile`, those of the documents in
`interventions_documents`, and those for sentences that replace refuted ones in
`interventions_reader`, `interventions_fourth_reader`, `interventions_fifth_reader`,
`interventions_sixth_reader` and `interventions_seventh_reader`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

from lessons.course import COURSE, load_lesson
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.measure import Measure, Signal, Statistic

Range = tuple[float, float]


@dataclass(frozen=True)
class Intervention:
    """A sentence that names a cause and its effect.

    Attributes:
        at: the place of the sentence: "lesson/place" for a step, "further/lesson" for a derivation on the
            page of the lesson, or the name of a document of `test_lessons_interventions.DOCUMENTS`.
        says: the sentence, or the part of it that names the cause, word for word.
        measure: the measure of the effect.
        there: the range of the measure with the cause, in its unit.
        without: assignments that remove the cause.
        gone: the range of the measure without the cause; it does not overlap `there`.
        of: assignments of the run that shows the effect, in addition to those of the step.
        on: the step or scene that is run, if it is not the step of `at`.
        seconds: the duration, if it is not that of the step.
        stays: the sentence says that this is *not* the cause: the effect also exists without it.
    """

    at: str
    says: str
    measure: Measure
    there: Range
    without: tuple[str, ...]
    gone: Range
    of: tuple[str, ...] = ()
    on: str = ""
    seconds: float | None = None
    stays: bool = False

    @property
    def runs(self) -> tuple[RunSpec, RunSpec]:
        """The run with the cause, and the run without it."""
        base = _base(self.on or self.at)
        if self.seconds is not None:
            base = replace(base, duration=self.seconds)
        return base.but(*self.of), base.but(*self.of, *self.without)


@cache
def _base(name: str) -> RunSpec:
    lesson, _, place = name.partition("/")
    if lesson not in COURSE:
        return RunSpec(name)
    found = load_lesson(lesson)
    return found.run_of(found.steps[int(place)])


def of(
    name: str,
    unit: str = "",
    statistic: Statistic = "largest",
    after: float = 0.0,
    until: float = math.inf,
    column: int | None = None,
) -> Measure:
    """Returns a measure; this function is a short form of the constructors."""
    return Measure(Signal(name, unit, column), statistic, after, until)

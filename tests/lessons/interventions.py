"""Explanations tested by intervention: the cause is taken away, and the effect has to go.

Each row quotes a sentence, names a run that shows the effect, what takes the cause away, and what is measured
with it and without. `interventions_all` has all of them: the course's are in `interventions_tasks`,
`interventions_limits` and `interventions_mobile`, the documents' in `interventions_documents`,
those of sentences that a reader had refuted in `interventions_reader`.
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
    """A sentence that says what causes what.

    Attributes:
        at: where it stands: "lesson/place" for a step, "further/lesson" for what its page derives, or the
            name of a document of `test_lessons_interventions.DOCUMENTS`.
        says: the sentence, or the part of it that names the cause, word for word.
        measure: the effect.
        there: its range with the cause, in the measure's unit.
        without: assignments that take the cause away.
        gone: its range then; it does not overlap `there`.
        of: assignments of the run that shows the effect, on top of the step's.
        on: the step or scene that is run, if it is not the step of `at`.
        seconds: how long, if not as long as the step.
        stays: the sentence says that this is *not* the cause: the effect is there without it, too.
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
        """With the cause, and without it."""
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
    """A measure in few words."""
    return Measure(Signal(name, unit, column), statistic, after, until)

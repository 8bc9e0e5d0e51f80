"""All runs of the course, computed once for all tests that measure them."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Any, NamedTuple

from interventions_all import ROWS
from quoted import specs
from quoted_all import QUOTED

from lessons.course import COURSE, load_lesson
from lessons.parallel import one_by_one
from lessons.recording.run import run
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.check import Outcome, Verdict, check
from lessons.teaching.measure import Measure, Signal


class CourseRuns(NamedTuple):
    """The check's verdicts of all lessons, and the values of `QUOTED` and of the interventions, by run."""

    verdicts: list[Verdict]
    values: dict[RunSpec, dict[Measure, float]]


END = Measure(Signal("t"))


def course_runs() -> CourseRuns:
    """Computes every run once. Runs that end early are computed again to their full duration, because the
    check stops at their end and sentences quote later values."""
    wanted: dict[RunSpec, dict[Measure, None]] = {}
    for each in QUOTED:
        for spec in specs(each):
            if spec is not None:
                wanted.setdefault(spec, {})[each.measure.alone] = None
    for row in ROWS:
        for spec in row.runs:
            wanted.setdefault(spec, {})[row.measure] = None
    values: dict[RunSpec, dict[Measure, float]] = {}

    def spread(
        function: Callable[[Any], Any], items: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        more = [(spec, (*measures, *wanted.get(spec, ()), END)) for spec, measures in items]
        for place, outcome in one_by_one(function, more):
            spec = more[place][0]
            if spec in wanted and isinstance(outcome, Outcome) and whole(spec, outcome.values[END]):
                values[spec] = {measure: outcome.values[measure] for measure in wanted[spec]}
            yield place, outcome

    verdicts = check([load_lesson(name) for name in COURSE], spread)
    for spec in wanted.keys() - values.keys():
        recording = run(spec.prepared(), to_the_end=True)
        values[spec] = {measure: measure.value(recording) for measure in wanted[spec]}
    return CourseRuns(verdicts, values)


def whole(spec: RunSpec, end: float) -> bool:
    """Whether a run was completed: its last period, which begins at `end` (s), is the last one of its
    duration."""
    return spec.duration is not None and end > spec.duration - 1.5 * spec.prepared().settings.T_s

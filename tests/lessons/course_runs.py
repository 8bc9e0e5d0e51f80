"""Computes all runs of the course once, for all tests that measure them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Generator, Hashable, Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from interventions_all import ROWS
from quoted import specs
from quoted_all import QUOTED

from lessons.course import COURSE, load_lesson
from lessons.parallel import FailedJob, guarded
from lessons.recording.recording import Recording
from lessons.recording.run import record
from lessons.scenes.run_spec import RunSpec
from lessons.session.start import begin
from lessons.teaching.check import Outcome, Verdict, check
from lessons.teaching.measure import Measure
from robots import InputError


class CourseRuns(NamedTuple):
    """The verdicts of the check on all lessons, and, by run, the values of `QUOTED` and of the
    interventions."""

    verdicts: list[Verdict]
    values: dict[RunSpec, dict[Measure, float]]


def course_runs() -> CourseRuns:
    """Computes every run once. A run that is the beginning of a longer run is taken from the longer one. Runs
    that end early are computed again to their full duration, because the check stops at their end and
    sentences quote later values."""
    wanted: dict[RunSpec, dict[Measure, None]] = {}
    for each in QUOTED:
        for spec in specs(each):
            if spec is not None:
                wanted.setdefault(spec, {})[each.measure.alone] = None
    for row in ROWS:
        for spec in row.runs:
            wanted.setdefault(spec, {})[row.measure] = None
    values: dict[RunSpec, dict[Measure, float]] = {}

    def take(found: dict[RunSpec, Recording]) -> None:
        for spec in found.keys() & wanted.keys():
            values[spec] = {measure: measure.value(found[spec]) for measure in wanted[spec]}

    def spread(
        function: Callable[[Any], Any], items: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        asked = {spec: (place, measures) for place, (spec, measures) in enumerate(items)}
        for group in alike(dict.fromkeys((*asked, *wanted))):
            found = guarded(recorded, group)
            if not isinstance(found, FailedJob):
                take({spec: each for spec, each in found.items() if whole(spec, each)})
            for spec in group:
                if spec in asked:
                    place, own = asked[spec]
                    yield place, found if isinstance(found, FailedJob) else judged(spec, own, found[spec])

    verdicts = check([load_lesson(name) for name in COURSE], spread)
    for group in alike(spec for spec in wanted if spec not in values):
        take(recorded(group, to_the_end=True))
    return CourseRuns(verdicts, values)


def alike(all_of_them: Iterable[RunSpec]) -> list[list[RunSpec]]:
    """Groups runs that are equal except for their durations; the longest comes first in each group."""
    groups: dict[Hashable, list[RunSpec]] = defaultdict(list)
    for spec in all_of_them:
        try:
            scene = spec.prepared()
        except InputError:
            groups[spec].append(spec)  # an execution of this run will report what is wrong
            continue
        start = replace(spec, controller=None, set=(), duration=None)
        groups[start, scene.events, scene.settings, scene.q_0.tobytes()].append(spec)
    return [sorted(group, key=lambda spec: -spec.prepared().duration) for group in groups.values()]


def recorded(group: Sequence[RunSpec], to_the_end: bool = False) -> dict[RunSpec, Recording]:
    """Returns the recordings of runs that differ only in their durations; the longest run is the first of the
    group. A shorter run is the beginning of the longest one, unless an event changes the period or the stack;
    then it is computed."""
    scene = group[0].prepared()
    session = begin(scene, group[0].seed)
    layout = session.layout
    longest = record(session, scene.duration, to_the_end=to_the_end)
    found = {group[0]: longest}
    for spec in group[1:]:
        if session.layout is layout and session.settings.T_s == scene.settings.T_s:
            found[spec] = Recording(session, list(longest.rows[: ticks(spec)]), longest.wall_s)
        else:
            found |= recorded([spec], to_the_end)
    return found


def ticks(spec: RunSpec) -> int:
    """Returns the number of control periods of a run that does not end early."""
    scene = spec.prepared()
    return max(1, round(scene.duration / scene.settings.T_s))


def whole(spec: RunSpec, recording: Recording) -> bool:
    """Whether a run was completed: its last period, which begins at the last recorded time, is the last one
    of its duration."""
    scene = spec.prepared()
    return float(recording["t"][-1, 0]) > scene.duration - 1.5 * scene.settings.T_s


def judged(spec: RunSpec, measures: Iterable[Measure], recording: Recording) -> Outcome:
    """Returns what the check measures in a run, and the number of events that were not accepted."""
    until = recording.duration - 1e-9
    due = sum(t < until for t, _ in spec.events or ())
    accepted = sum(t < until for t, _ in recording.session.log)
    values = {measure: measure.value(recording) for measure in measures}
    return Outcome(values, max(0, due - accepted))

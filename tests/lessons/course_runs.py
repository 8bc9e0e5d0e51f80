"""Computes all runs of the course once, for all tests that measure them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Generator, Hashable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from evidence import Told, documents

from lessons.course import COURSE, load_lesson
from lessons.parallel import FailedJob, guarded
from lessons.recording.run import Recording, record
from lessons.scenes.run_spec import RunSpec
from lessons.session.start import begin
from lessons.teaching.check import Outcome, Piece, Verdict, judge, judge_note, needed, perform
from lessons.teaching.lesson import Lesson
from robots import InputError


class CourseRuns(NamedTuple):
    """The verdicts of the check on all lessons, and those on the notes of documents."""

    verdicts: list[Verdict]
    documents: Mapping[Told, Verdict]


def course_runs(claimed: Collection[str], noted: Collection[str], with_documents: bool) -> CourseRuns:
    """Computes every run once. A run that is the beginning of a longer run is taken from the longer one.

    claimed: the lessons that are judged; noted: those whose notes are judged, too; with_documents: whether
    the notes of documents are.
    """
    lessons = [load_lesson(name) for name in COURSE if name in {*claimed, *noted}]
    lessons = [lesson if lesson.name in noted else without_notes(lesson) for lesson in lessons]
    told = {
        each: each.note.runs(each.run)
        for each in (documents() if with_documents else ())
        if each.note.measure is not None
    }
    outcomes = perform(needed(lessons, [(each.note, runs) for each, runs in told.items()]), spread)
    return CourseRuns(
        [verdict for lesson in lessons for verdict in judge(lesson, outcomes)],
        {each: judge_note(each.at, each.says, each.note, runs, outcomes) for each, runs in told.items()},
    )


def without_notes(lesson: Lesson) -> Lesson:
    return replace(lesson, steps=tuple(replace(step, notes=()) for step in lesson.steps))


def spread(function: Callable[[Any], Any], items: Sequence[Any]) -> Generator[tuple[int, Any], None, None]:
    """Performs the runs of `check.perform` in groups of `alike` ones. Runs that end early are computed again
    to their full duration, because the check stops at their end and sentences quote later values."""
    asked = {piece[0]: (place, piece) for place, piece in enumerate(items)}
    for group in alike(asked):
        found = guarded(recorded, group)
        if isinstance(found, FailedJob):
            yield from ((asked[spec][0], found) for spec in group)
            continue
        early = [spec for spec in group if asked[spec][1][2] and not whole(spec, found[spec])]
        late = {**found, **(recorded(early, to_the_end=True) if early else {})}
        for spec in group:
            place, piece = asked[spec]
            yield place, judged(piece, found[spec], late[spec])


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


def judged(piece: Piece, recording: Recording, to_the_end: Recording) -> Outcome:
    """Returns what the check measures in a run, and the number of events that were not accepted."""
    spec, measures, noted = piece
    until = recording.duration - 1e-9
    due = sum(t < until for t, _ in spec.events or ())
    accepted = sum(t < until for t, _ in recording.session.log)
    values = {measure: measure.value(recording) for measure in measures}
    late = {measure: measure.value(to_the_end) for measure in noted}
    return Outcome(values, max(0, due - accepted), noted=late)

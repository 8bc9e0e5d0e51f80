"""Runs lessons headless and checks four things: claims hold, claims can fail, challenges can be solved, and
the numbers and causes in the texts are those of the runs that their notes name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from lessons.parallel import FailedJob, Spread, on_cores
from lessons.recording.run import run
from lessons.scenes.run_spec import RunSpec
from lessons.settings.assignments import parse_assignment
from lessons.teaching.lesson import Challenge, Claim, Lesson, Note, Range, Step
from lessons.teaching.measure import Measure
from lessons.teaching.prediction import Choice, Prediction


@dataclass(frozen=True)
class Outcome:
    """The result of a run.

    Attributes:
        values: the measured values, without comparison with a ghost.
        refused: number of events of the script that were not accepted.
        error: one sentence if the run failed; None if it did not fail.
        noted: the values for notes, of the whole duration: a run for claims ends with its mission, or when
            control is lost, and a sentence can be about a later moment.
    """

    values: Mapping[Measure, float]
    refused: int = 0
    error: str | None = None
    noted: Mapping[Measure, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Verdict:
    """The result of one check.

    Attributes:
        lesson: name of the lesson.
        where: the step's title, or "challenge".
        what: the claim, prediction, script, solution or note.
        value, unit: the measured value; NaN if there is nothing to measure.
        condition: the required condition.
        wrong: the setting under which a claim must fail, or which removes the cause of a note; "" for other
            checks.
        wrong_value: the value measured under that setting.
        fault: one sentence; "" if the check is passed.
    """

    lesson: str
    where: str
    what: str
    value: float = math.nan
    unit: str = ""
    condition: str = ""
    wrong: str = ""
    wrong_value: float = math.nan
    fault: str = ""


Outcomes = Mapping[RunSpec, Outcome]
Piece = tuple[RunSpec, tuple[Measure, ...], tuple[Measure, ...]]
"""A run, the measures that claims need of it, and those that notes need."""


def measured(piece: Piece) -> Outcome:
    """Performs a run and returns its measured values. Raises InputError if the run is not possible."""
    what, measures, noted = piece
    recording = run(what.prepared())
    values = {measure: measure.value(recording) for measure in measures}
    due = sum(t < recording.duration - 1e-9 for t, _ in what.events or ())
    refused = max(0, due - len(recording.session.log))
    if noted and (recording.session.over or recording.session.diverged_at is not None):
        recording = run(what.prepared(), to_the_end=True)
    return Outcome(values, refused, noted={measure: measure.value(recording) for measure in noted})


def check(
    lessons: Sequence[Lesson],
    spread: Spread = on_cores,
    progress: Callable[[float], None] | None = None,
) -> list[Verdict]:
    """Performs all runs that the lessons need, each only once, and checks all statements of the lessons.

    Args:
        lessons: the lessons.
        spread: function that distributes the runs over the cores.
        progress: called after each run with the completed share.

    Returns:
        one verdict per claim, prediction, script, challenge and measured note, in the order of the lessons.
    """
    outcomes = perform(needed(lessons), spread, progress)
    return [verdict for lesson in lessons for verdict in judge(lesson, outcomes)]


def perform(
    pieces: Iterable[Piece], spread: Spread = on_cores, progress: Callable[[float], None] | None = None
) -> Outcomes:
    """Performs runs, the long ones first, to keep all cores busy until the end."""
    work = sorted(pieces, key=lambda piece: -(piece[0].duration or 0.0))
    outcomes: dict[RunSpec, Outcome] = {}
    for index, outcome in spread(measured, work):
        done = Outcome({}, 0, outcome.reason) if isinstance(outcome, FailedJob) else outcome
        outcomes[work[index][0]] = done
        if progress is not None:
            progress(len(outcomes) / len(work))
    return outcomes


def needed(lessons: Sequence[Lesson], notes: Iterable[tuple[Note, Sequence[RunSpec]]] = ()) -> list[Piece]:
    """Returns all runs with the measures that are needed of each run.

    notes: notes of other texts than the lessons, with their runs.
    """
    wanted: dict[RunSpec, dict[Measure, None]] = {}
    noted: dict[RunSpec, dict[Measure, None]] = {}

    def want(run: RunSpec, measures: Iterable[Measure], into: dict[RunSpec, dict[Measure, None]]) -> None:
        into.setdefault(run, {}).update(dict.fromkeys(measure.alone for measure in measures))

    for lesson in lessons:
        for step in lesson.steps:
            run = lesson.run_of(step)
            measures = _measures(step)
            want(run, measures, wanted)
            if step.ghost is not None:
                want(
                    run.but(*step.ghost.set), [measure for measure in measures if measure.over_ghost], wanted
                )
            for claim in step.claims:
                want(run.but(*claim.fails_with), [claim.measure], wanted)
        if lesson.challenge is not None:
            start = lesson.run_of(lesson.challenge)
            for assignments in ((), *lesson.challenge.solutions):
                want(start.but(*assignments), lesson.challenge.measures, wanted)
        notes = (*notes, *((note, _runs(lesson, step, note)) for step in lesson.steps for note in step.notes))
    for note, runs in notes:
        if note.measure is not None:
            for run in runs:
                want(run, [note.measure], noted)
    return [(run, tuple(wanted.get(run, ())), tuple(noted.get(run, ()))) for run in {**wanted, **noted}]


def _runs(lesson: Lesson, step: Step, note: Note) -> tuple[RunSpec, ...]:
    return note.runs(lesson.run_of(step), step.ghost.set if step.ghost else ())


def _measures(step: Step) -> list[Measure]:
    measures = [claim.measure for claim in step.claims]
    prediction = step.prediction
    return [*measures, prediction.measure] if prediction is not None else measures


def judge(lesson: Lesson, outcomes: Outcomes) -> list[Verdict]:
    """Returns the verdicts on one lesson."""
    verdicts = []
    for step in lesson.steps:
        run = lesson.run_of(step)
        script = _script(lesson.name, step.title, outcomes[run])
        verdicts += [script] if script else []
        if outcomes[run].error is not None:
            continue
        verdicts += [_claim(lesson, step, claim, outcomes) for claim in step.claims]
        if step.prediction is not None:
            verdicts.append(_prediction(lesson, step, step.prediction, outcomes))
        for note in step.notes:
            if note.measure is not None:
                verdicts.append(
                    judge_note(lesson.name, step.title, note, _runs(lesson, step, note), outcomes)
                )
    if lesson.challenge is not None:
        verdicts += _challenge(lesson, lesson.challenge, outcomes)
    return verdicts


def _script(lesson: str, where: str, outcome: Outcome) -> Verdict | None:
    if outcome.error is not None:
        return Verdict(lesson, where, "run", fault=f"it cannot be run: {outcome.error}")
    if outcome.refused:
        return Verdict(lesson, where, "script", fault=f"{outcome.refused} of its events are not accepted")
    return None


def _value(measure: Measure, run: RunSpec, step: Step, lesson: Lesson, outcomes: Outcomes) -> float:
    own = outcomes[run].values.get(measure.alone, math.nan)
    if not measure.over_ghost or step.ghost is None:
        return own
    ghost = lesson.run_of(step).but(*step.ghost.set)
    other = outcomes[ghost].values.get(measure.alone, math.nan)
    return own / other if other else math.nan


def _claim(lesson: Lesson, step: Step, claim: Claim, outcomes: Outcomes) -> Verdict:
    run = lesson.run_of(step)
    wrong = run.but(*claim.fails_with)
    value = _value(claim.measure, run, step, lesson, outcomes)
    other = _value(claim.measure, wrong, step, lesson, outcomes)
    fault = ""
    if not claim.holds(value):
        fault = f"it is false: {_figure(value, claim.measure.unit)}, not {claim.condition}"
    elif outcomes[wrong].error is not None:
        fault = f"its wrong setting cannot be run: {outcomes[wrong].error}"
    elif math.isnan(other):
        fault = f"with {', '.join(claim.fails_with)} there is nothing to measure"
    elif claim.holds(other):
        fault = f"it holds with {', '.join(claim.fails_with)} too: {_figure(other, claim.measure.unit)}"
    return Verdict(
        lesson.name,
        step.title,
        claim.text,
        value,
        claim.measure.unit,
        claim.condition,
        ", ".join(claim.fails_with),
        other,
        fault,
    )


def _prediction(lesson: Lesson, step: Step, prediction: Prediction, outcomes: Outcomes) -> Verdict:
    value = _value(prediction.measure, lesson.run_of(step), step, lesson, outcomes)
    unit = prediction.measure.unit
    if isinstance(prediction, Choice):
        fitting = [option for option in prediction.options if option.low <= value < option.high]
        condition = fitting[0].text if fitting else "no option"
        tempting = prediction.options[prediction.tempting]
        if len(fitting) != 1:
            fault = f"{len(fitting)} of its options fit {_figure(value, unit)}"
        else:
            fault = "the tempting option is the right one" if tempting is fitting[0] else ""
    else:
        condition = f"between {prediction.low:g} and {prediction.high:g} {unit}"
        inside = prediction.low <= value <= prediction.high
        fault = "" if inside else f"{_figure(value, unit)} is off its scale"
    return Verdict(
        lesson.name, step.title, f"prediction: {prediction.question}", value, unit, condition, fault=fault
    )


def _challenge(lesson: Lesson, challenge: Challenge, outcomes: Outcomes) -> list[Verdict]:
    start = lesson.run_of(challenge)
    verdicts = []
    script = _script(lesson.name, "challenge", outcomes[start])
    verdicts += [script] if script else []
    for assignments in ((), *challenge.solutions):
        outcome = outcomes[start.but(*assignments)]
        result = challenge.result([outcome.values.get(measure, math.nan) for measure in challenge.measures])
        name = f"solution {', '.join(assignments)}" if assignments else "start"
        missed = [goal.text for goal, met in zip(challenge.goals, result.met, strict=True) if not met]
        foreign = [assignment for assignment in assignments if not _allowed(challenge, assignment)]
        fault = ""
        if outcome.error is not None:
            fault = f"it cannot be run: {outcome.error}"
        elif foreign:
            fault = f"{foreign[0]} is not one of its knobs, or is outside the knob's range"
        elif assignments and missed:
            fault = f"it does not pass: {'; '.join(missed)}"
        elif not assignments and not missed:
            fault = "it passes with its first settings"
        condition = "misses a goal" if not assignments else "meets all goals"
        value = result.score if assignments else math.nan
        verdicts.append(
            Verdict(
                lesson.name, "challenge", name, value, "points" if assignments else "", condition, fault=fault
            )
        )
    return verdicts


def judge_note(lesson: str, where: str, note: Note, runs: Sequence[RunSpec], outcomes: Outcomes) -> Verdict:
    """Returns the verdict on a note with a measure; lesson and where: the place of its sentence."""
    assert note.measure is not None
    unit, what = note.measure.unit, f"[^{note.label}] {note.says}"
    errors = [outcomes[run].error for run in runs if outcomes[run].error is not None]
    if errors:
        return Verdict(lesson, where, what, fault=f"it cannot be run: {errors[0]}")
    values = [outcomes[run].noted.get(note.measure.alone, math.nan) for run in runs]
    if note.measure.over_ghost:
        *values, ghost = values
        values = [value / ghost if ghost else math.nan for value in values]
    wanted = [_between(interval, unit) for interval in (note.inside, note.outside)]
    missed = [
        f"{_figure(value, unit)}, not {condition}"
        for value, condition, (low, high) in zip(values, wanted, (note.inside, note.outside), strict=False)
        if not low <= value <= high
    ]
    other = values[1] if note.without else math.nan
    wrong = ", ".join(note.without)
    fault = "; ".join(missed)
    return Verdict(lesson, where, what, values[0], unit, wanted[0], wrong, other, fault)


def _between(limits: Range, unit: str) -> str:
    low, high = limits
    return (f"≥ {low:g}" if math.isinf(high) else f"from {low:g} to {high:g}") + f" {unit}".rstrip()


def _allowed(challenge: Challenge, assignment: str) -> bool:
    path, value = parse_assignment(assignment)
    return any(knob.path == path and knob.takes(value) for knob in challenge.knobs)


def _figure(value: float, unit: str) -> str:
    return "nothing to measure" if math.isnan(value) else f"{value:.4g} {unit}".rstrip()

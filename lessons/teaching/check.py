"""Runs lessons headless and checks three things: claims hold, claims can fail, and challenges can be
solved."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from lessons.parallel import FailedJob, Spread, on_cores
from lessons.recording.run import run
from lessons.scenes.run_spec import RunSpec
from lessons.settings.assignments import parse_assignment
from lessons.teaching.challenge import Challenge
from lessons.teaching.claim import Claim
from lessons.teaching.lesson import Lesson, Step
from lessons.teaching.measure import Measure
from lessons.teaching.prediction import Choice, Prediction


@dataclass(frozen=True)
class Outcome:
    """The result of a run.

    Attributes:
        values: the measured values, without comparison with a ghost.
        refused: number of events of the script that were not accepted.
        error: one sentence if the run failed; None if it did not fail.
    """

    values: Mapping[Measure, float]
    refused: int = 0
    error: str | None = None


@dataclass(frozen=True)
class Verdict:
    """The result of one check.

    Attributes:
        lesson: name of the lesson.
        where: the step's title, or "challenge".
        what: the claim, prediction, script or solution.
        value, unit: the measured value; NaN if there is nothing to measure.
        condition: the required condition.
        wrong: the setting under which a claim must fail; "" for other checks.
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


def measured(piece: tuple[RunSpec, tuple[Measure, ...]]) -> Outcome:
    """Performs a run and returns its measured values. Raises InputError if the run is not possible."""
    what, measures = piece
    recording = run(what.prepared())
    values = {measure: measure.value(recording) for measure in measures}
    due = sum(t < recording.duration - 1e-9 for t, _ in what.events or ())
    return Outcome(values, max(0, due - len(recording.session.log)))


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
        one verdict per claim, prediction, script and challenge, in the order of the lessons.
    """
    wanted = _wanted(lessons)
    # Long runs start first, to keep all cores busy until the end.
    pieces = sorted(wanted.items(), key=lambda item: -(item[0].duration or 0.0))
    outcomes: dict[RunSpec, Outcome] = {}
    work = [(run, tuple(measures)) for run, measures in pieces]
    for place, outcome in spread(measured, work):
        run = work[place][0]
        outcomes[run] = Outcome({}, 0, outcome.reason) if isinstance(outcome, FailedJob) else outcome
        if progress is not None:
            progress(len(outcomes) / len(work))
    return [verdict for lesson in lessons for verdict in judge(lesson, outcomes)]


def _wanted(lessons: Sequence[Lesson]) -> dict[RunSpec, dict[Measure, None]]:
    """Returns all runs with the measures that are needed of each run."""
    wanted: dict[RunSpec, dict[Measure, None]] = {}

    def want(run: RunSpec, measures: Sequence[Measure]) -> None:
        wanted.setdefault(run, {}).update(dict.fromkeys(measure.alone for measure in measures))

    for lesson in lessons:
        for step in lesson.steps:
            run = lesson.run_of(step)
            measures = _measures(step)
            want(run, measures)
            if step.ghost is not None:
                want(run.but(*step.ghost.set), [each for each in measures if each.over_ghost])
            for claim in step.claims:
                want(run.but(*claim.fails_with), [claim.measure])
        if lesson.challenge is not None:
            start = lesson.run_of(lesson.challenge)
            for assignments in ((), *lesson.challenge.solutions):
                want(start.but(*assignments), lesson.challenge.measures)
    return wanted


def _measures(step: Step) -> list[Measure]:
    found = [claim.measure for claim in step.claims]
    prediction = step.prediction
    return [*found, prediction.measure] if prediction is not None else found


def judge(lesson: Lesson, outcomes: Outcomes) -> list[Verdict]:
    """Returns the verdicts on one lesson."""
    found = []
    for step in lesson.steps:
        run = lesson.run_of(step)
        script = _script(lesson.name, step.title, outcomes[run])
        found += [script] if script else []
        if outcomes[run].error is not None:
            continue
        found += [_claim(lesson, step, claim, outcomes) for claim in step.claims]
        if step.prediction is not None:
            found.append(_prediction(lesson, step, step.prediction, outcomes))
    if lesson.challenge is not None:
        found += _challenge(lesson, lesson.challenge, outcomes)
    return found


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
        fitting = [each for each in prediction.options if each.low <= value < each.high]
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
    found = []
    script = _script(lesson.name, "challenge", outcomes[start])
    found += [script] if script else []
    for assignments in ((), *challenge.solutions):
        outcome = outcomes[start.but(*assignments)]
        result = challenge.result([outcome.values.get(each, math.nan) for each in challenge.measures])
        name = f"solution {', '.join(assignments)}" if assignments else "start"
        missed = [goal.text for goal, met in zip(challenge.goals, result.met, strict=True) if not met]
        foreign = [each for each in assignments if not _allowed(challenge, each)]
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
        found.append(
            Verdict(
                lesson.name, "challenge", name, value, "points" if assignments else "", condition, fault=fault
            )
        )
    return found


def _allowed(challenge: Challenge, assignment: str) -> bool:
    path, value = parse_assignment(assignment)
    return any(knob.path == path and knob.takes(value) for knob in challenge.knobs)


def _figure(value: float, unit: str) -> str:
    return "nothing to measure" if math.isnan(value) else f"{value:.4g} {unit}".rstrip()

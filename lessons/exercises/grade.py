"""Grades a submission, which runs in a separate process, by the motion of the robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np

from himpc.controllers.own import OwnController
from himpc.controllers.view import View
from himpc.references import Preview
from lessons.exercises import EXERCISES, load_exercise
from lessons.exercises.apart import Apart, Exhausted
from lessons.exercises.exercise import Exercise, GradeCheck
from lessons.exercises.mistakes import Diagnosis
from lessons.own.files import Source, read
from lessons.recording.recording import Recording
from lessons.recording.run import checked_duration, record
from lessons.scenes.catalog import as_torque_scene, prepared
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.torque_scene import TorqueScene
from lessons.session.torque import TorqueSession
from lessons.settings.torque import TorqueSettings
from robots import InputError, Robot
from robots.processes.isolation import PATIENCE, Allowance, Fault, isolated

WITHIN = Allowance(60.0, 4_000_000_000, "grading it", "was ended by the program itself", "leave that out")
"""Time and memory for grading one file."""


@dataclass(frozen=True)
class CheckResult:
    """One check with the measured value.

    Attributes:
        check: the sentence of the check.
        measured: value in `unit`; NaN if there was nothing to measure.
        unit, wanted: e.g. "mm", "≤ 0.5 mm".
        points, of: points given, and points possible.
        why: one sentence with the cause if the check fails, "" if it holds.
    """

    check: str
    measured: float
    unit: str
    wanted: str
    points: int
    of: int
    why: str


@dataclass(frozen=True)
class Grade:
    """The grade of a submission.

    Attributes:
        file: its path.
        digest: hash of its content.
        exercise: name of the exercise, "" if it is unknown.
        lines: one per check; empty if the file could not be run.
        error: one sentence if it could not be run, or was ended.
        protection: mechanisms of the operating system that refused it files, the network and other processes;
            () if only Python refused them.
    """

    file: str
    digest: str
    exercise: str
    lines: tuple[CheckResult, ...] = ()
    error: str = ""
    protection: tuple[str, ...] = ()

    @property
    def points(self) -> int:
        return sum(line.points for line in self.lines)

    @property
    def of(self) -> int:
        return sum(line.of for line in self.lines) or 10

    @property
    def passed(self) -> bool:
        return not self.error and self.points == self.of


@dataclass(frozen=True)
class Submission:
    """A file to be graded, as it is sent to another process or another machine.

    Attributes:
        source: the file as it was read.
        exercise: name of the exercise; None: the name that the file assigns to EXERCISE.
        seed: seed of the disturbances.
        within: time and memory for grading it.
        kernel: whether the operating system refuses it files, the network and other processes; otherwise
            only Python refuses them.
    """

    source: Source
    exercise: str | None = None
    seed: int = 0
    within: Allowance = WITHIN
    kernel: bool = True


class Shown(Protocol):
    """A submission as the checks see it: only its inputs and its outputs."""

    @property
    def where(self) -> str:
        """File and line, for the beginning of a sentence."""
        ...

    def fresh(self) -> Callable[[View], Any]:
        """Its control law, loaded anew, so that it has no memory of earlier runs."""
        ...


def grade(path: str, exercise: str | None = None, seed: int = 0) -> Grade:
    """Grades a file, in a process of its own; arguments as of `Submission`.

    Raises:
        InputError: there is no such exercise or no such file.
    """
    if exercise is not None:
        load_exercise(exercise)
    return grade_apart(Submission(read(path), exercise, seed))


def grade_apart(submission: Submission) -> Grade:
    """Grades a submission in a process of its own. If that process fails, the grade contains the error."""
    source, asked = submission.source, submission.exercise
    # Only the time in the submission's own process counts, not the time of the checks.
    within = replace(submission.within, seconds=PATIENCE * submission.within.seconds)
    try:
        return isolated(graded, submission, within=within, copied=True)
    except Fault as fault:
        error = f"{source.path}: {fault}"
    except InputError as refusal:
        error = str(refusal)
    return Grade(source.path, source.digest, asked or "", error=error)


def graded(submission: Submission) -> Grade:
    """Grades a submission with the plant and the checks in this process; the submission runs in another one.

    Raises:
        InputError: the file cannot be loaded, or the name of its exercise is missing or unknown.
    """
    source, within = submission.source, submission.within
    with Apart(source, within.seconds, within.memory, submission.kernel) as apart:
        name = submission.exercise or apart.exercise
        if name not in EXERCISES:
            raise InputError(
                f'{source.path}: has no name of an exercise: write e.g. EXERCISE = "joint-pd" at its '
                f"top, or name one of {', '.join(EXERCISES)}"
            )
        try:
            lines = judged_by(load_exercise(name), apart, submission.seed)
        except Exhausted as end:
            return Grade(source.path, source.digest, name, (), str(end), apart.protection)
        return Grade(source.path, source.digest, name, lines, protection=apart.protection)


def judged_by(exercise: Exercise, shown: Shown, seed: int) -> tuple[CheckResult, ...]:
    """The results of all checks of an exercise; if a run fails, only the checks of this run fail."""
    recordings: dict[RunSpec, Recording | str] = {}
    diagnosis = Diagnosis(exercise.mistakes)
    lines: list[CheckResult] = []
    general: list[tuple[int, str]] = []  # lines that name a possible mistake, and how they begin
    for check in exercise.checks(seed):
        begins = ""
        try:
            value, fault = _measured(check, shown, diagnosis, recordings), ""
        except _Lost as lost:
            value, fault, begins = math.nan, "", f"{lost}: "
        except InputError as error:
            value, fault = math.nan, str(error)
        held = check.holds(value)
        lines.append(
            CheckResult(
                check.text,
                value,
                check.unit,
                check.condition,
                check.points if held else 0,
                check.points,
                "" if held else fault or begins + check.why,
            )
        )
        if not held and not fault:
            general.append((len(lines) - 1, begins))
    if diagnosis.says:
        for place, begins in general:
            lines[place] = replace(lines[place], why=begins + diagnosis.says)
    return tuple(lines)


class _Lost(Exception):
    """The robot went out of control; the message says when."""


def _measured(
    check: GradeCheck, shown: Shown, diagnosis: Diagnosis, recordings: dict[RunSpec, Recording | str]
) -> float:
    if check.measure is None:
        return beside(_scene(check.run, check.beside), shown, diagnosis, check.run.duration or 1.0)
    if check.run not in recordings:
        scene = _scene(check.run)
        session = TorqueSession(scene, controllers=partial(_own, shown, diagnosis))
        try:
            recordings[check.run] = record(session, checked_duration(scene.duration))
        except InputError as error:
            recordings[check.run] = str(error)
    found = recordings[check.run]
    if isinstance(found, str):
        raise InputError(found)
    if found.session.diverged_at is not None:
        raise _Lost(f"the robot was out of control at {found.session.diverged_at:.2f} s")
    return check.measure.value(found)


def _scene(run: RunSpec, controller: str | None = None) -> TorqueScene:
    return as_torque_scene(prepared(run.prepared(), controller, ()), "a controller of your own")


def _own(shown: Shown, diagnosis: Diagnosis, settings: TorqueSettings, robot: Robot) -> OwnController:
    """The controller of a submission: this process computes the data that it gets, and the submission's
    process computes the torque."""
    diagnosis.begin()

    def call(law: Callable[[View], Any], now: View) -> Any:
        answer = law(now)
        diagnosis.see(now, answer)
        return answer

    return OwnController(robot, settings.for_controller(), shown.fresh, call, shown.where)


def beside(scene: TorqueScene, shown: Shown, diagnosis: Diagnosis, duration: float) -> float:
    """The largest difference in torque, N·m, between the scene's controller, which drives, and a submission
    that is shown the same states. Raises InputError if the submission fails."""
    session = TorqueSession(scene)
    other = _own(shown, diagnosis, scene.settings, session.robot)
    other.reset(session.plant.tau)
    worst = 0.0
    while session.t < duration - 1e-9 and session.diverged_at is None:
        session.drain()
        applied = session.plant.tau.copy()
        session.tick()
        given, plan = session.given, session.plan
        assert given is not None and plan is not None
        previews: dict[str, Preview] = dict(given.previews)
        answer = other.step(given.q, given.v, previews, applied)
        if answer.notice is not None:
            raise InputError(answer.notice)
        worst = max(worst, float(np.abs(answer.tau - plan.tau).max()))
    return worst


def as_data(found: Grade) -> dict[str, Any]:
    """JSON-ready."""
    return {
        "file": found.file,
        "sha256": found.digest,
        "exercise": found.exercise,
        "points": found.points,
        "of": found.of,
        "error": found.error,
        "protection": list(found.protection),
        "checks": [
            {**vars(line), "measured": line.measured if math.isfinite(line.measured) else None}
            for line in found.lines
        ],
    }

"""Grades a submission, which runs in a separate process, by the motion of the robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from himpc.controllers.own import OwnController
from himpc.controllers.view import View
from lessons.exercises import EXERCISES, load_exercise
from lessons.exercises.apart import Apart, Exhausted, Refused
from lessons.exercises.exercise import Exercise, GradeCheck
from lessons.exercises.mistakes import Diagnosis, Law
from lessons.exercises.own import check_order, exercise_of
from lessons.exercises.result import CheckResult, Grade
from lessons.own.files import SUFFIX, Source, is_file, read
from lessons.recording.run import Recording, checked_duration, record
from lessons.scenes.catalog import as_torque_scene, prepared
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession
from lessons.settings.torque import TorqueSettings
from robots import InputError, Robot
from robots.processes.isolation import PATIENCE, Allowance, Fault, isolated

WITHIN = Allowance(60.0, 4_000_000_000, "grading it", "was ended by the program itself", "leave that out")
"""Time and memory for grading one file."""


@dataclass(frozen=True)
class Submission:
    """A file to be graded, as it is sent to another process or another machine.

    Attributes:
        source: the file as it was read.
        exercise: name of the exercise; None: the name that the file assigns to EXERCISE.
        seed: seed of the disturbances.
        within: time and memory for grading it.
        kernel: whether the operating system blocks access to files, the network and other processes;
            otherwise only Python blocks it.
        own: the file of the exercise, if it is a teacher's own.
        possible: points that the exercise gives.
    """

    source: Source
    exercise: str | None = None
    seed: int = 0
    within: Allowance = WITHIN
    kernel: bool = True
    own: Source | None = None
    possible: int = 10

    @classmethod
    def to(
        cls, exercise: str | None, source: Source, seed: int = 0, within: Allowance = WITHIN
    ) -> Submission:
        """Returns a submission to an exercise. exercise: its name, or the path of a teacher's file.

        Raises:
            InputError: there is no such exercise, or the teacher's file cannot be used.
        """
        if exercise is None:
            return cls(source, None, seed, within)
        if not is_file(exercise):
            load_exercise(exercise)
            return cls(source, exercise, seed, within)
        own = read(exercise)
        definition = exercise_of(own)
        possible = sum(check.points for check in definition.checks(seed))
        return cls(source, definition.name, seed, within, own=own, possible=possible)


class Shown(Protocol):
    """A submission as the checks use it: only its inputs and its outputs."""

    @property
    def where(self) -> str:
        """The file and the line, as the beginning of an error message."""
        ...

    def fresh(self) -> Callable[[View], Any]:
        """Loads the control law again, so that it has no memory of earlier runs, and returns it."""
        ...


def grade(path: str, exercise: str | None = None, seed: int = 0) -> Grade:
    """Grades a file in a separate process. The arguments are those of `Submission`.

    Raises:
        InputError: there is no such exercise or no such file, the file of the exercise cannot be used, or the
            files are in the wrong order.
    """
    source = read(path)
    check_order(source, exercise)
    return grade_apart(Submission.to(exercise, source, seed))


def grade_only(path: Path, exercise: str | None = None, seed: int = 0) -> Grade:
    """Grades a file, or the only Python file of a folder. If there is no such file or more than one, or the
    file cannot be read, the grade contains an error.

    Raises:
        InputError: there is no such exercise, or the file of the exercise cannot be used.
    """
    files = sorted(path.glob(f"*{SUFFIX}")) if path.is_dir() else [path]
    source, error = Source(str(files[0] if len(files) == 1 else path), ""), ""
    try:
        if len(files) != 1:
            names = ", ".join(file.name for file in files[:5]) or "none"
            raise InputError(f"hand in one Python file: found {names}")
        source = read(str(files[0]))
    except InputError as refusal:
        error = str(refusal)
    try:
        check_order(source, exercise)
    except InputError as refusal:
        return Grade(source.path, source.digest, exercise or "", error=str(refusal))
    model = Submission.to(exercise, source, seed)
    if error:
        return Grade(source.path, "", exercise or "", error=error, possible=model.possible)
    return grade_apart(model)


def grade_apart(submission: Submission) -> Grade:
    """Grades a submission in a separate process. If this process fails, the grade contains the error."""
    source, name = submission.source, submission.exercise
    # Only the time in the submission's own process counts, not the time of the checks.
    within = replace(submission.within, seconds=PATIENCE * submission.within.seconds)
    try:
        return isolated(graded, submission, within=within, copied=True)
    except Fault as fault:
        error = f"{source.path}: {fault}"
    except InputError as refusal:
        error = str(refusal)
    return Grade(source.path, source.digest, name or "", error=error, possible=submission.possible)


def graded(submission: Submission) -> Grade:
    """Grades a submission with the plant and the checks in this process; the submission runs in another
    process.

    Raises:
        InputError: the file cannot be loaded, or the name of its exercise is missing or unknown.
    """
    source, within = submission.source, submission.within
    own = None if submission.own is None else exercise_of(submission.own)
    with Apart(source, within.seconds, within.memory, submission.kernel) as apart:
        name = submission.exercise or apart.exercise
        if own is None and name not in EXERCISES:
            raise InputError(
                f'{source.path}: has no name of an exercise: write e.g. EXERCISE = "joint-pd" at its '
                f"top, or name one of {', '.join(EXERCISES)}"
            )
        exercise = own or load_exercise(name)
        try:
            lines = judged_by(exercise, apart, submission.seed)
            apart.close()
        except Refused as refusal:
            checks = exercise.checks(submission.seed)
            lines = tuple(_result(check, math.nan, str(refusal)) for check in checks)
        except Exhausted as end:
            return Grade(
                source.path, source.digest, name, (), str(end), apart.protection, submission.possible
            )
        return Grade(source.path, source.digest, name, lines, protection=apart.protection)


def judged_by(exercise: Exercise, shown: Shown, seed: int) -> tuple[CheckResult, ...]:
    """Returns the results of all checks of an exercise. If a run fails, only the checks of this run fail."""
    recordings: dict[RunSpec, Recording | str] = {}
    diagnosis = Diagnosis(exercise.mistakes)
    lines: list[CheckResult] = []
    general: list[tuple[int, str]] = []  # index of a failed check, and the beginning of its sentence
    for check in exercise.checks(seed):
        begins = ""
        try:
            value, fault = _measured(check, shown, diagnosis, recordings), ""
        except _Lost as lost:
            value, fault, begins = math.nan, "", f"{lost}: "
        except InputError as error:
            value, fault = math.nan, str(error)
        lines.append(_result(check, value, fault or begins + check.why))
        if not check.holds(value) and not fault:
            general.append((len(lines) - 1, begins))
    if diagnosis.says:
        for index, begins in general:
            lines[index] = replace(lines[index], why=begins + diagnosis.says)
    return tuple(lines)


def _result(check: GradeCheck, value: float, why: str) -> CheckResult:
    """Returns the result of a check; why: the reason if the check fails."""
    held = check.holds(value)
    points = check.points if held else 0
    return CheckResult(
        check.text, value, check.unit, check.condition, points, check.points, "" if held else why
    )


class _Lost(Exception):
    """The robot went out of control; the message says when."""


def _measured(
    check: GradeCheck, shown: Shown, diagnosis: Diagnosis, recordings: dict[RunSpec, Recording | str]
) -> float:
    if check.measure is None:
        return beside(check.run, check.beside, shown, diagnosis)
    if check.run not in recordings:
        scene = _scene(check.run)
        session = TorqueSession(scene, controllers=partial(_own, shown, diagnosis))
        try:
            recordings[check.run] = record(session, checked_duration(scene.duration))
        except InputError as error:
            recordings[check.run] = str(error)
    recording = recordings[check.run]
    if isinstance(recording, str):
        raise InputError(recording)
    if recording.session.diverged_at is not None:
        raise _Lost(f"the robot was out of control at {recording.session.diverged_at:.2f} s")
    return check.measure.value(recording)


def _scene(run: RunSpec, controller: str | None = None) -> TorqueScene:
    return as_torque_scene(prepared(run.prepared(), controller, ()), "a controller of your own")


def _own(shown: Shown, diagnosis: Diagnosis, settings: TorqueSettings, robot: Robot) -> OwnController:
    """Returns the controller of a submission. This process computes the data for the controller, and the
    submission's process computes the torque."""
    diagnosis.begin()

    def call(law: Callable[[View], Any], now: View) -> Any:
        answer = law(now)
        diagnosis.see(now, answer)
        return answer

    return OwnController(robot, settings.for_controller(), shown.fresh, call, shown.where)


@dataclass(frozen=True)
class _Given:
    """A control law of the lab, as a submission."""

    law: Law
    where: str = "the law of the exercise"

    def fresh(self) -> Law:
        return self.law


def beside(run: RunSpec, controller: str | Law, shown: Shown, diagnosis: Diagnosis) -> float:
    """Returns the largest difference, N·m, between the torque of a controller, which moves the robot, and the
    torque of a submission for the same states. Raises InputError if the submission fails."""
    if isinstance(controller, str):
        scene = _scene(run, controller)
        session = TorqueSession(scene)
    else:
        scene = _scene(run)
        session = TorqueSession(scene, controllers=partial(_own, _Given(controller), Diagnosis(())))
    duration = run.duration or 1.0
    other = _own(shown, diagnosis, scene.settings, session.robot)
    other.reset(session.plant.tau)
    worst = 0.0
    while session.t < duration - 1e-9 and session.diverged_at is None:
        session.drain()
        applied = session.plant.tau.copy()
        session.tick()
        controller_input, plan = session.controller_input, session.plan
        assert controller_input is not None and plan is not None
        answer = other.step(controller_input.q, controller_input.v, controller_input.previews, applied)
        if answer.notice is not None:
            raise InputError(answer.notice)
        worst = max(worst, float(np.abs(answer.tau - plan.tau).max()))
    return worst

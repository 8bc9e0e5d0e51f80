"""Grading: a submission is run in a process of its own and judged by what it does."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from himpc.references import Preview
from lessons.exercises import EXERCISES, load_exercise
from lessons.exercises.exercise import Check, Exercise
from lessons.own.controllers import controller_of
from lessons.own.files import Source, execute, read
from lessons.own.kinds import law_of
from lessons.recording.recording import Recording
from lessons.recording.run import run
from lessons.scenes.catalog import as_torque_scene, prepared
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.torque_scene import TorqueScene
from lessons.session.torque import TorqueSession
from robots import InputError
from robots.isolation import Allowance, Fault, isolated

WITHIN = Allowance(60.0, 4_000_000_000, "grading it", "was ended by the program itself", "leave that out")
"""What grading one file may cost."""
_WRITING = frozenset("wax+")
_REFUSED = ("socket.", "subprocess.", "os.system", "os.exec", "os.fork", "os.posix_spawn", "os.kill",
            "os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.truncate", "os.link", "os.symlink",
            "shutil.", "webbrowser.", "ctypes.")  # fmt: skip


@dataclass(frozen=True)
class Line:
    """One check with what was measured.

    Attributes:
        check: its sentence.
        measured: in `unit`; NaN if there was nothing to measure.
        unit, wanted: e.g. "mm", "≤ 0.5 mm".
        points, of: given, possible.
        why: one sentence where it is missed, "" where it is met.
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
    """What a submission is worth.

    Attributes:
        file: its path.
        digest: of its content.
        exercise: name of the exercise, "" if nobody knows which.
        lines: one per check; none if it could not be run.
        error: one sentence if it could not be run, or was ended.
    """

    file: str
    digest: str
    exercise: str
    lines: tuple[Line, ...] = ()
    error: str = ""

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
        exercise: which; None: what the file says in EXERCISE.
        seed: decides the disturbances.
        within: what grading it may cost.
    """

    source: Source
    exercise: str | None = None
    seed: int = 0
    within: Allowance = WITHIN


def grade(path: str, exercise: str | None = None, seed: int = 0) -> Grade:
    """Grades a file, in a process of its own; arguments as of `Submission`.

    Raises:
        InputError: there is no such exercise or no such file.
    """
    if exercise is not None:
        load_exercise(exercise)
    return grade_apart(Submission(read(path), exercise, seed))


def grade_apart(submission: Submission) -> Grade:
    """Grades a submission in a process of its own; whatever it does there is a grade."""
    source, asked = submission.source, submission.exercise
    with _placed(source) as here:
        try:
            found = isolated(graded, here, asked, submission.seed, within=submission.within, copied=True)
        except Fault as fault:
            found = Grade(here.path, here.digest, asked or "", error=f"{here.path}: {fault}")
        except InputError as error:
            found = Grade(here.path, here.digest, asked or "", error=str(error))
    lines = (replace(line, why=line.why.replace(here.path, source.path)) for line in found.lines)
    error = found.error.replace(here.path, source.path)
    return replace(found, file=source.path, lines=tuple(lines), error=error)


@contextmanager
def _placed(source: Source) -> Iterator[Source]:
    """The file where it was read or, on a machine that has it not, written to a folder of its own."""
    try:
        there = read(source.path).text == source.text
    except InputError:
        there = False
    if there:
        yield source
        return
    with TemporaryDirectory() as folder:
        path = Path(folder) / Path(source.path).name
        path.write_text(source.text, encoding="utf-8")
        yield Source(str(path), source.text)


def graded(source: Source, exercise: str | None, seed: int) -> Grade:
    """The same in this process, which the submission may end or block. Raises InputError for a file that
    cannot be loaded."""
    refuse_from(source.path)
    module = execute(source)
    law_of(module)
    name = exercise or str(vars(module).get("EXERCISE", ""))
    if name not in EXERCISES:
        raise InputError(
            f'{source.path}: does not say which exercise it is: write e.g. EXERCISE = "joint-pd" at its top, '
            f"or name one of {', '.join(EXERCISES)}"
        )
    lines = judged_by(load_exercise(name), source.path, seed)
    return Grade(source.path, source.digest, name, lines)


def judged_by(exercise: Exercise, path: str, seed: int) -> tuple[Line, ...]:
    """Every check of an exercise; a run that fails costs its own checks only."""
    recordings: dict[RunSpec, Recording | str] = {}
    lines = []
    for check in exercise.checks(seed):
        try:
            value, fault = _measured(check, path, recordings), ""
        except InputError as error:
            value, fault = math.nan, str(error)
        held = check.holds(value)
        lines.append(
            Line(
                check.text,
                value,
                check.unit,
                check.condition,
                check.points if held else 0,
                check.points,
                "" if held else fault or check.why,
            )
        )
    return tuple(lines)


def _measured(check: Check, path: str, recordings: dict[RunSpec, Recording | str]) -> float:
    if check.measure is None:
        return beside(_scene(check.run, check.beside), path, check.run.duration or 1.0)
    if check.run not in recordings:
        try:
            recordings[check.run] = run(_scene(check.run, path))
        except InputError as error:
            recordings[check.run] = str(error)
    found = recordings[check.run]
    if isinstance(found, str):
        raise InputError(found)
    if found.session.diverged_at is not None:
        raise InputError(f"the robot was out of control at {found.session.diverged_at:.2f} s: {check.why}")
    return check.measure.value(found)


def _scene(run: RunSpec, controller: str) -> TorqueScene:
    return as_torque_scene(prepared(run.prepared(), controller, ()), "a controller of your own")


def beside(scene: TorqueScene, path: str, duration: float) -> float:
    """The largest difference in torque, N·m, between the scene's controller, which drives, and a file's that
    is shown the same states. Raises InputError if the file's fails."""
    session = TorqueSession(scene)
    other = controller_of(prepared(scene, path, ()).settings, session.robot)
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
        "checks": [
            {**vars(line), "measured": line.measured if math.isfinite(line.measured) else None}
            for line in found.lines
        ],
    }


def refuse_from(path: str) -> None:
    """From now on whatever a file's code does with other files, programs or the network is refused. This is
    politeness among people who mean well, no prison."""

    def hook(event: str, given: Sequence[Any]) -> None:
        reading = event == "open" and not _WRITING & set(str(given[1] or "r"))
        if event != "open" and not event.startswith(_REFUSED):
            return
        if reading and str(given[0]).endswith((".py", ".pyc", ".so", ".pyd")):
            return  # an import
        frame = sys._getframe(1)
        while frame is not None:
            if frame.f_code.co_filename == path:
                what = f"{event} {given[0]:.60}" if isinstance(given[0], str) else event
                raise PermissionError(f"a submission may not do that ({what})")
            frame = frame.f_back

    sys.addaudithook(hook)

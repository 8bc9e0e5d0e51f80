"""`himpc-lab grade`: exercises, solutions, the progress that a learner handed in, and the folder of an
autograder for Gradescope's containers."""

from __future__ import annotations

import math
import re
import shutil
import sys
from collections.abc import Mapping
from contextlib import nullcontext
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from app.commands.output import print_table, progress_bar, write_json
from robots import InputError
from robots.errors import unknown_name

if TYPE_CHECKING:
    from lessons.exercises.exercise import Exercise
    from lessons.exercises.grade import Grade
    from lessons.exercises.result import CheckResult

PACKAGES = ("robots", "himpc", "lessons", "app")
_ROOT = Path(__file__).parents[2]

_SETUP = """#!/usr/bin/env bash
# Gradescope runs this once, as root, when the image is built; this folder is then /autograder/source.
set -e
root="${AUTOGRADER:-/autograder}"
export DEBIAN_FRONTEND=noninteractive
apt-get update
apt-get install -y libseccomp2 libgomp1
apt-get install -y python3.12 python3.12-venv || apt-get install -y python3.11 python3.11-venv
$(command -v python3.12 || command -v python3.11) -m venv "$root/venv"
"$root/venv/bin/pip" install -r "$root/source/requirements.txt"
# The controllers are compiled now, not with the first submission.
cd "$root/source"
"$root/venv/bin/python" -m app new controller /tmp/start.py --from EXERCISE
"$root/venv/bin/python" -m app grade /tmp/start.py EXERCISE || test $? -eq 1
"""
_RUN = """#!/usr/bin/env bash
# Gradescope runs this for every submission, and reads results/results.json.
root="${AUTOGRADER:-/autograder}"
cd "$root/source"
"${PYTHON:-$root/venv/bin/python}" -m app grade "$root/submission" EXERCISE \\
  --format gradescope --json "$root/results/results.json"
# Exit codes 1 and 2 say that points are missing, or that the file cannot be run: results.json says the same.
test -s "$root/results/results.json"
"""
_OWN = "exercise.py"


def write_autograder(exercise: str, folder: Path) -> int:
    """Writes the folder: `setup.sh`, `run_autograder`, the list of packages to install, and himpc-lab itself.

    Args:
        exercise: name of an exercise, or path of the file of a teacher's own exercise.
        folder: path of the folder, which must not exist yet.

    Raises:
        InputError: there is no such exercise, or the folder exists already or cannot be written.
    """
    from lessons.exercises.own import any_exercise
    from lessons.own.files import is_file

    any_exercise(exercise)
    own = is_file(exercise)
    try:
        folder.mkdir(parents=True)
        for name, text in (("setup.sh", _SETUP), ("run_autograder", _RUN)):
            (folder / name).write_text(text.replace("EXERCISE", _OWN if own else exercise), encoding="utf-8")
            (folder / name).chmod(0o755)
        if own:
            shutil.copy(exercise, folder / _OWN)
        (folder / "requirements.txt").write_text("\n".join(requirements()) + "\n", encoding="utf-8")
        for name in PACKAGES:
            shutil.copytree(_ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    except OSError as error:
        reason = error.strerror or "some files could not be copied"
        raise InputError(
            f"--out {folder}: cannot be written ({reason}); give a folder that does not exist yet"
        ) from None
    print(
        f"{folder} is written. Zip its content, not the folder itself, and upload the file to Gradescope:\n"
        f"  cd {folder} && zip -r ../autograder.zip ."
    )
    return 0


def requirements() -> list[str]:
    """Returns the packages that himpc-lab needs, with the versions that are installed here."""
    found: dict[str, str] = {}
    left = ["himpc-lab"]
    while left:
        name = left.pop()
        try:
            installed = distribution(name)
        except PackageNotFoundError:  # needed on another system
            continue
        if name != "himpc-lab":
            found[name] = installed.version
        wanted = [each for each in installed.requires or () if "extra ==" not in each]
        names = {re.split(r"[^\w.-]", each, maxsplit=1)[0].lower().replace("_", "-") for each in wanted}
        left += sorted(names - found.keys() - {"himpc-lab"})
    if not found:
        raise InputError(
            f"{sys.executable} does not know the packages of himpc-lab: install himpc-lab with pip first"
        )
    return [f"{name}=={version}" for name, version in sorted(found.items())]


TEXTS = (".txt", ".text", "")
"""Extensions of files that may contain a learner's progress as text."""


def handed_in(file: Path, key: str | None, json: str | None) -> int:
    """Prints the progress that a learner handed in, and whether a lab with the key signed it."""
    from app.link.exercise import parts_of
    from lessons.course import COURSE, load_lesson
    from lessons.replay.progress import read_handed_in, read_key

    try:
        if not file.is_file():  # reading a named pipe would wait for ever
            raise OSError
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        raise InputError(f"{file}: cannot be read as text; give the file that the page exported") from None
    try:
        handed, proof = read_handed_in(text, None if key is None else read_key(key))
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    progress = handed.progress
    lessons = [
        {
            "lesson": name,
            "steps": [place + 1 for place in sorted(progress.seen.get(name, ()))],
            "of": len(parts_of(load_lesson(name))),
            "score": progress.best.get(name),
        }
        for name in COURSE
        if name in progress.seen or name in progress.best
    ]
    if json is not None:
        said = {"name": handed.name, "account": handed.account, "at": handed.at, "proof": proof}
        write_json({**said, "code": handed.code, "lessons": lessons}, json)
    else:
        rows = [
            [str(each["lesson"]), f"{len(each['steps'])} of {each['of']}", _score(each["score"])]
            for each in lessons
        ]
        print_table(f"{handed.name or 'nobody'}, {handed.at}", ("lesson", "steps run", "best score"), rows)
        print(_SAYS[proof] if key else _NOT_JUDGED)
        if handed.account:
            known = key is not None and proof == "signed"
            print(f"account: {handed.account}" + ("" if known else ", which is not proven"))
        if handed.code:
            print(f"setting on the page then: himpc-lab --state {handed.code}")
    return 0 if key is None or proof == "signed" else 1


def _score(points: float | None) -> str:
    return "–" if points is None else f"{points:.0f}"


_SAYS = {
    "signed": "signed by a lab with your key",
    "not signed": "not signed: anybody could have written it",
    "signed with another key": "signed with another key, or changed",
}
_NOT_JUDGED = "signature not checked: give the key of your lab with --key FILE"


def print_exercise(exercise: Exercise, begin: str, hints: int) -> None:
    """Prints the card of an exercise, its checks and its first hints; begin: the command that starts it."""
    card = exercise.card
    of = f"; belongs to lesson {exercise.lesson}" if exercise.lesson else ""
    print(f"{exercise.name}: {card.title} ({card.minutes} minutes{of})")
    print(f"  {card.question}")
    print(f"  {exercise.plain}")
    print(f"  begin: {begin}")
    for check in exercise.checks(0):
        print(f"    {check.points} points: {check.text} {check.condition}")
    print_hints(exercise.hints, hints)


def print_hints(all_hints: tuple[str, ...], count: int) -> None:
    for number, hint in enumerate(all_hints[:count], start=1):
        print(f"hint {number} of {len(all_hints)}: {hint}")


def check_exercise(file: Path, seed: int, hints: int, json: str | None) -> int:
    """Shows and tests the exercise of a teacher's file. Exit code 0: the exercise can be used; 1: the report
    names errors."""
    from lessons.exercises.own import exercise_in
    from lessons.exercises.prove import prove
    from lessons.parallel import on_cores

    exercise = exercise_in(str(file))
    if json is None:
        print_exercise(exercise, f"himpc-lab new controller {exercise.file} --from {file}", hints)
    with progress_bar(f"grading the solution and the mistakes of {file} …", json is None) as advance:
        proof = prove(str(file), seed, on_cores, advance)
    if json is not None:
        write_json({"name": exercise.name, "faults": list(proof.faults)}, json)
        return 1 if proof.faults else 0
    graded = [("the solution", proof.solution), ("the start", proof.start), *proof.mistakes]
    rows = [[says, f"{grade.points}/{grade.of}", _missed(grade.lines)] for says, grade in graded]
    print_table(str(file), ("file", "points", "checks that it fails"), rows)
    print("\n".join(proof.faults) or "the exercise can be used")
    return 1 if proof.faults else 0


def _missed(lines: tuple[CheckResult, ...]) -> str:
    return ", ".join(str(place) for place, line in enumerate(lines, start=1) if line.why)


def grade(
    file: tyro.conf.Positional[Path | None] = None,
    exercise: tyro.conf.Positional[str | None] = None,
    hints: int = 0,
    seed: int = 0,
    out: Path | None = None,
    scheduler: str | None = None,
    key: str | None = None,
    json: str | None = None,
    format: Literal["gradescope", "github"] | None = None,
    visibility: Literal["visible", "hidden", "after_due_date", "after_published"] = "visible",
    check: Path | None = None,
    autograder: str | None = None,
) -> int:
    """Run a solution of an exercise and grade its behaviour; without a file, list the exercises.

    Give the name of an exercise instead of a file to show this exercise; --hints N also shows its first N
    hints. For an exercise of your own: himpc-lab grade SOLUTIONS EXERCISE.py. The exercise is always the
    second argument: it is executed with your rights, and solutions are not.

    Every file runs in a separate process for at most a minute. A folder of submissions gives one table. If
    grading was stopped, the same command continues it. Exit code 0: all points; 1: some points are missing;
    2: the solution cannot be run.

    Args:
        file: one of these: a Python file with a solution; a folder of such files; the name of an exercise; a
            learner's progress, as the page exported it.
        exercise: name of the exercise, or the file of an exercise of your own; by default the name that the
            solution assigns to EXERCISE.
        hints: number of hints of the exercise to show.
        seed: seed of the disturbances, from 0 to 2⁶³ − 1.
        out: file for the table of a folder, grades.csv by default; an unfinished table is continued. With
            --autograder: the new folder, autograder by default.
        scheduler: address of a Dask scheduler, e.g. tcp://10.0.0.1:8786, which grades a folder instead of
            this machine's cores.
        key: file with the key of your lab, for checking whether your lab signed a learner's progress.
        json: write JSON to this file, or to standard output for "-".
        format: write JSON for Gradescope or for GitHub Classroom's reporter, to results.json or --json. Only
            for one file, or a folder with one file.
        visibility: time at which Gradescope shows the checks to students.
        check: file of an exercise of your own: show the exercise and test it. Its solution must get all
            points, every mistake must lose some, and every check must be failed by a mistake.
        autograder: name or file of an exercise: write the folder for Gradescope's containers.
    """
    from lessons.exercises import EXERCISES
    from lessons.exercises.grade import grade as grade_file
    from lessons.exercises.result import as_data
    from lessons.scenes.run_spec import check_seed

    check_seed(seed)
    if check is not None:
        return check_exercise(check, seed, hints, json)
    if autograder is not None:
        return write_autograder(autograder, Path("autograder") if out is None else out)
    if file is None or (exercise is None and str(file) in EXERCISES and not file.exists()):
        return _list(None if file is None else str(file), hints, json)
    if not file.exists() and exercise is None and not file.suffix:
        raise unknown_name("file or exercise called", str(file), EXERCISES)
    if format is not None:
        return _formatted(file, exercise, seed, format, visibility, json)
    if file.is_dir():
        return _folder(file, exercise, seed, out or Path("grades.csv"), scheduler, json)
    if file.suffix in TEXTS:
        return handed_in(file, key, json)
    found = grade_file(str(file), exercise, seed)
    if json is not None:
        write_json(as_data(found), json)
    else:
        _show(found, exercise, hints)
    return _code(found)


def _code(found: Grade) -> int:
    return 2 if found.error else 0 if found.passed else 1


def _formatted(
    file: Path,
    exercise: str | None,
    seed: int,
    form: Literal["gradescope", "github"],
    visibility: Literal["visible", "hidden", "after_due_date", "after_published"],
    json: str | None,
) -> int:
    """Returns the grade of one file in the format of another system. Every submission gets a grade, also an
    invalid one."""
    from lessons.exercises.grade import grade_only
    from lessons.exercises.result import formatted

    target = json or "results.json"
    if target != "-":
        Path(target).unlink(missing_ok=True)  # a file that a student handed in must not pass for the result
    found = grade_only(file, exercise, seed)
    write_json(formatted(found, form, visibility), target)
    if target != "-":
        print(f"{found.points} of {found.of} points: {target}")
    return _code(found)


def _show(found: Grade, exercise: str | None, hints: int) -> None:
    from lessons.exercises.own import any_exercise

    if found.error:
        print(f"{found.error}\n0 of {found.of} points")
        if found.protection:
            print(_kept(found.protection))
        return
    rows = [
        [
            f"{line.points}/{line.of}",
            line.check,
            "–" if math.isnan(line.measured) else f"{line.measured:.3g} {line.unit}",
            line.wanted,
            line.why,
        ]
        for line in found.lines
    ]
    columns = ("points", "what is checked", "measured", "required", "why points are missing")
    print_table(f"{found.file} · {found.exercise}", columns, rows)
    print(f"{found.points} of {found.of} points")
    print(_kept(found.protection))
    print_hints(any_exercise(exercise or found.exercise).hints, hints)


def _kept(protection: tuple[str, ...]) -> str:
    """Returns a sentence about the isolation of a submission."""
    if not protection:
        return "files, network and processes were refused by Python alone, which hostile code can bypass"
    return f"files, network and processes were refused by {' and '.join(protection)}, and by Python"


def _list(exercise: str | None, hints: int, json: str | None) -> int:
    from lessons.exercises import EXERCISES, load_exercise

    chosen = [load_exercise(name) for name in ([exercise] if exercise is not None else EXERCISES)]
    if json is not None:
        write_json(
            [
                {
                    "name": each.name,
                    "title": each.card.title,
                    "question": each.card.question,
                    "minutes": each.card.minutes,
                    "needs": each.card.needs,
                    "equation": each.equation,
                    "lesson": each.lesson,
                    "checks": [check.text for check in each.checks(0)],
                }
                for each in chosen
            ],
            json,
        )
        return 0
    for each in chosen:
        print_exercise(each, each.commands()[0], hints)
    return 0


def _folder(
    folder: Path, exercise: str | None, seed: int, out: Path, scheduler: str | None, json: str | None
) -> int:
    from lessons.cluster import on_cluster
    from lessons.exercises.folder import grade_folder
    from lessons.parallel import on_cores

    way = nullcontext(on_cores) if scheduler is None else on_cluster(scheduler)
    with way as spread, progress_bar(f"grading {folder} …", json is None) as advance:
        rows = grade_folder(folder, exercise, seed, out, spread, advance)
    if json is not None:
        write_json(rows, json)
        return 0
    print_table(str(folder), ("file", "exercise", "points", "what is missing"), [_short(row) for row in rows])
    print(f"{len(rows)} files, table: {out}")
    if any(row["exercise"] and not row["protection"] for row in rows):
        print(_kept(()))
    return 0


def _short(row: Mapping[str, str]) -> list[str]:
    return [row["file"], row["exercise"], f"{row['points']}/{row['of']}", row["error"] or row["missed"]]

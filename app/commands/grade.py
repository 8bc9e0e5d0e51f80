"""`himpc-lab grade`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from app.commands.autograder import write_autograder
from app.commands.handed_in import TEXTS, handed_in
from app.commands.output import print_table, write_json
from app.commands.own_exercise import check_exercise, print_exercise, print_hints
from app.commands.progress import progress_bar
from robots.errors import unknown_name

if TYPE_CHECKING:
    from lessons.exercises.grade import Grade


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

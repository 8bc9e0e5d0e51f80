"""`himpc-lab grade`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from app.commands.output import print_table, write_json
from app.commands.progress import progress_bar
from robots import InputError
from robots.errors import unknown_name

if TYPE_CHECKING:
    from lessons.exercises.grade import Grade


def grade(
    file: tyro.conf.Positional[Path | None] = None,
    exercise: tyro.conf.Positional[str | None] = None,
    hints: int = 0,
    seed: int = 0,
    out: Path = Path("grades.csv"),
    scheduler: str | None = None,
    key: str | None = None,
    json: str | None = None,
) -> int:
    """Run a solution of an exercise and grade its behaviour; without a file, list the exercises.

    The name of an exercise instead of a file shows this exercise, with --hints N also its first N hints.

    Every file runs in a process of its own for at most a minute. A folder of submissions gives one table. If
    the command was stopped, the same command continues it. Exit code 0: all points; 1: some are missing; 2:
    it cannot be run.

    Args:
        file: Python file with the solution, or a folder of them; or the name of an exercise; or the text that
            the page wrote about a learner's progress.
        exercise: name of the exercise; by default the name that the file assigns to EXERCISE.
        hints: number of hints of the exercise to show.
        seed: seed of the disturbances.
        out: file for the table of a folder; an unfinished table is continued.
        scheduler: address of a Dask scheduler, e.g. tcp://10.0.0.1:8786, for a folder, instead of this
            machine's cores.
        key: file with the key of your lab, to check whether your lab signed the progress that was handed in.
        json: write JSON to this file, or to standard output for "-".
    """
    from lessons.exercises import EXERCISES
    from lessons.exercises.grade import as_data
    from lessons.exercises.grade import grade as grade_file

    if file is None or (exercise is None and str(file) in EXERCISES and not file.exists()):
        return _list(None if file is None else str(file), hints, json)
    if not file.exists() and exercise is None and not file.suffix:
        raise unknown_name("file or exercise called", str(file), EXERCISES)
    if file.is_dir():
        return _folder(file, exercise, seed, out, scheduler, json)
    if file.suffix in _TEXTS:
        return _handed_in(file, key, json)
    found = grade_file(str(file), exercise, seed)
    if json is not None:
        write_json(as_data(found), json)
    else:
        _show(found, hints)
    return 2 if found.error else 0 if found.passed else 1


def _show(found: Grade, hints: int) -> None:
    from lessons.exercises import load_exercise

    if found.error:
        print(f"{found.error}\n0 of 10 points")
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
    _hints(load_exercise(found.exercise).hints, hints)


def _kept(protection: tuple[str, ...]) -> str:
    """A sentence about what isolated a submission."""
    if not protection:
        return "files, network and processes were refused by Python alone, which hostile code can bypass"
    return f"files, network and processes were refused by {' and '.join(protection)}, and by Python"


def _hints(all_hints: tuple[str, ...], count: int) -> None:
    for number, hint in enumerate(all_hints[:count], start=1):
        print(f"hint {number} of {len(all_hints)}: {hint}")


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
        card = each.card
        print(f"{each.name}: {card.title} ({card.minutes} minutes; belongs to lesson {each.lesson})")
        print(f"  {card.question}")
        print(f"  {each.plain}")
        print(f"  begin: {each.commands()[0]}")
        for check in each.checks(0):
            print(f"    {check.points} points: {check.text} {check.condition}")
        _hints(each.hints, hints)
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


_TEXTS = (".txt", ".text", "")
"""Name of a file that contains the text which the page wrote."""


def _handed_in(file: Path, key: str | None, json: str | None) -> int:
    from app.link.exercise import parts_of
    from lessons.course import COURSE, load_lesson
    from lessons.replay.progress import read_handed_in, read_key

    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        raise InputError(
            f"{file}: cannot be read as text; give the file with the text that the page wrote"
        ) from None
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
        data = {"name": handed.name, "at": handed.at, "proof": proof, "code": handed.code, "lessons": lessons}
        write_json(data, json)
    else:
        rows = [
            [str(each["lesson"]), f"{len(each['steps'])} of {each['of']}", _score(each["score"])]
            for each in lessons
        ]
        print_table(f"{handed.name or 'nobody'}, {handed.at}", ("lesson", "steps run", "best score"), rows)
        print(_SAYS[proof] if key else _NOT_JUDGED)
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

"""Grades a folder of submissions and writes a table. An interrupted grading continues from the table."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from lessons.exercises.cells import cell, of_cell
from lessons.exercises.grade import WITHIN, Submission, grade_apart
from lessons.exercises.result import Grade
from lessons.outputs import write_files
from lessons.own.files import SUFFIX, Source, fingerprint, is_file, read
from lessons.parallel import FailedJob, Spread
from robots import InputError
from robots.processes.isolation import Allowance

COLUMNS: tuple[str, ...] = (
    *("file", "exercise", "points", "of", "missed", "error", "seed", "asked", "sha256", "protection"),
)
Row = dict[str, str]


def grade_folder(
    folder: Path,
    exercise: str | None,
    seed: int,
    out: Path,
    spread: Spread,
    progress: Callable[[float], None],
    within: Allowance = WITHIN,
) -> list[Row]:
    """Grades every Python file of a folder, each in a process of its own.

    Args:
        folder: the folder of the submissions.
        exercise: name of the exercise, or path of a teacher's own exercise; None: the name that each file
            assigns to EXERCISE.
        seed: seed of the disturbances, which are the same for all files.
        out: CSV file; the existing row of a file is used again if the file has not changed.
        spread: function that distributes the work over the cores.
        progress: called with the completed share.
        within: time and memory for grading one file.

    Raises:
        InputError: there is no such exercise, the folder has no Python file, or the table cannot be written.
    """
    mark = exercise if exercise is None or not is_file(exercise) else fingerprint(exercise)
    files = sorted(path for path in folder.iterdir() if path.suffix == SUFFIX and path.is_file())
    if not files:
        raise InputError(f"{folder}: has no Python file; give a folder of submissions")
    model = Submission.to(exercise, Source("", ""), seed, within)
    held = {(row["file"], row["sha256"], row["seed"], row["asked"]): row for row in _rows(out)}
    done: dict[Path, Row] = {}
    left: list[Source] = []
    for path in files:
        try:
            source = read(str(path))
        except InputError as error:
            done[path] = row_of(Grade(str(path), "", exercise or "", error=str(error)), seed, mark)
            continue
        row = held.get((_text(path.name), source.digest, str(seed), mark or ""))
        if row is None:
            left.append(source)
        else:
            done[path] = row
    work = spread(grade_apart, [replace(model, source=source) for source in left])
    with closing(work) as outcomes:
        for index, outcome in outcomes:
            source = left[index]
            if isinstance(outcome, FailedJob):
                outcome = Grade(source.path, source.digest, exercise or "", error=outcome.reason)
            done[Path(source.path)] = row_of(outcome, seed, mark)
            _write(out, [done[path] for path in files if path in done])
            progress(len(done) / len(files))
    rows = [done[path] for path in files]
    _write(out, rows)
    return rows


def row_of(grade: Grade, seed: int, mark: str | None) -> Row:
    """Returns a grade as a row of the table."""
    missed = "; ".join(f"{line.check} {line.why}" for line in grade.lines if line.why)
    name = Path(grade.file).name
    values = (
        name,
        grade.exercise,
        str(grade.points),
        str(grade.of),
        _one_line(missed.replace(grade.file, name)),
        _one_line(grade.error.replace(grade.file, name)),
        str(seed),
        mark or "",
        grade.digest,
        " ".join(grade.protection),
    )
    return dict(zip(COLUMNS, map(_text, values), strict=True))


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _text(name: str) -> str:
    """Returns the text as valid UTF-8. Names of files may contain any bytes."""
    return name.encode(errors="replace").decode()


def _rows(out: Path) -> Iterator[Row]:
    """Yields the rows that a table already contains; none if there is no such file. Raises InputError if the
    file is not a table of grades."""
    if not out.exists():
        return
    try:
        with out.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            if tuple(reader.fieldnames or ()) != COLUMNS:
                raise InputError(f"{out}: is not a table of himpc-lab grade; give another file for --out")
            for row in reader:
                yield {name: of_cell(value or "") for name, value in row.items()}
    except (OSError, UnicodeDecodeError, csv.Error):
        raise InputError(f"{out}: cannot be read; give another file for --out") from None


def _write(out: Path, rows: list[Row]) -> None:
    """Writes the whole table. If writing is interrupted, the old file is unchanged."""
    table = io.StringIO()
    writer = csv.DictWriter(table, COLUMNS)
    writer.writeheader()
    writer.writerows({name: cell(value) for name, value in row.items()} for row in rows)
    try:
        write_files({out: table.getvalue()})
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror}); give another file") from None

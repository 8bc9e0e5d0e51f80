"""Teachers' own exercises: one Python file with the text, the missing lines, the checks and the solution."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import lru_cache, partial
from inspect import cleandoc
from textwrap import indent

from lessons.exercises import load_exercise
from lessons.exercises.exercise import Exercise, GradeCheck
from lessons.exercises.mistakes import Law, Mistake
from lessons.own.files import Source, execute, is_file, read
from lessons.own.kinds import expected, law_of
from lessons.own.load import load
from lessons.teaching.lesson import Card
from robots import InputError

HOLE = "TODO"
"""The one line of the start that contains this word is replaced by the missing lines."""


def filled(start: str, lines: str) -> str:
    """Returns the start with these lines instead of the line with `TODO`, at the indentation of that line.

    Raises:
        InputError: no line, or more than one, contains TODO.
    """
    holes = [line for line in start.splitlines() if HOLE in line]
    if len(holes) != 1:
        raise InputError(
            f"start has {len(holes) or 'no'} lines with {HOLE}: mark the missing lines by one comment with "
            "this word"
        )
    margin = holes[0][: len(holes[0]) - len(holes[0].lstrip())]
    return start.replace(holes[0], indent(cleandoc(lines), margin))


def own_exercise(
    name: str,
    card: Card,
    start: str,
    solution: str,
    mistakes: Mapping[str, str],
    checks: Callable[[int], tuple[GradeCheck, ...]],
    plain: str = "",
    equation: str = "",
    hints: tuple[str, ...] = (),
    lesson: str = "",
) -> Exercise:
    """Returns an exercise whose solution and mistakes are lines of code.

    Args:
        name: name in the table of grades and in the names of files.
        card: title, question, minutes and required knowledge.
        start: the file that students complete; one line contains the word TODO.
        solution: the right lines instead of the line with TODO.
        mistakes: wrong lines; the key is the sentence that names the mistake.
        checks: function that returns the checks for a seed; the seed decides the disturbances.
        plain, equation: what students implement, as plain text and in LaTeX.
        hints: hints for students, shown one by one.
        lesson: the lesson to which the exercise belongs.

    Raises:
        InputError: start has no line with TODO, or more than one.
    """
    start = cleandoc(start) + "\n"
    return Exercise(
        name,
        card,
        equation,
        plain,
        hints,
        lesson,
        checks,
        tuple(_mistake(says, filled(start, lines)) for says, lines in mistakes.items()),
        start,
        filled(start, solution),
    )


def _mistake(says: str, text: str) -> Mistake:
    return Mistake(says, partial(_law, text), text)


def _law(text: str) -> Law:
    """Returns the control law of a teacher's text, without memory of earlier runs."""
    return law_of(execute(Source("a known mistake", text)))()


def check_order(source: Source, exercise: str | None) -> None:
    """Raises InputError if a submission looks like the file of an exercise, and the exercise is another file:
    a command that names the exercise first would execute the file of a student. Neither file is executed."""
    if exercise is not None and is_file(exercise) and _makes_one(source):
        raise InputError(
            f"{source.path}: is the file of an exercise, which stands after the solutions: "
            f"himpc-lab grade {exercise} {source.path}"
        )


def any_exercise(name: str) -> Exercise:
    """Returns the lab's exercise with this name, or the exercise of a teacher's file.

    Raises:
        InputError: no exercise has this name, or the file cannot be used.
    """
    return exercise_in(name) if is_file(name) else load_exercise(name)


def exercise_in(path: str) -> Exercise:
    """Returns the exercise of a teacher's file. Raises InputError if the file cannot be used."""
    return exercise_of(read(path))


@lru_cache(maxsize=8)
def exercise_of(source: Source) -> Exercise:
    """Executes a teacher's file in this process and returns its exercise.

    Raises:
        InputError: the file cannot be loaded or used, or does not assign a call of `own_exercise` to
            EXERCISE. A file without this assignment is not executed: it may be a student's.
    """
    if not _makes_one(source):
        raise InputError(
            f"{source.path}: is not the file of an exercise: it must assign EXERCISE = own_exercise(…). The "
            "exercise stands after the solutions: himpc-lab grade SOLUTIONS EXERCISE.py"
        )
    module = load(source)
    expected(module, "exercise")
    exercise = vars(module)["EXERCISE"]
    if not isinstance(exercise, Exercise) or not exercise.solution:
        raise InputError(f"{source.path}: EXERCISE must be made with own_exercise(…)")
    _checked(source.path, exercise)
    return exercise


def _makes_one(source: Source) -> bool:
    try:
        body = ast.parse(source.text).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return any(
        isinstance(statement, ast.Assign)
        and isinstance(statement.value, ast.Call)
        and ast.unparse(statement.value.func).rpartition(".")[2] == "own_exercise"
        and any(isinstance(to, ast.Name) and to.id == "EXERCISE" for to in statement.targets)
        for statement in body
    )


def _checked(path: str, exercise: Exercise) -> None:
    """Raises InputError if a field has the wrong type, or a check cannot be judged."""
    texts = ("name", "equation", "plain", "lesson")
    wrong = [field.name for field in fields(exercise) if field.name in texts]
    wrong = [name for name in wrong if not isinstance(getattr(exercise, name), str)]
    if wrong:
        raise InputError(f"{path}: {wrong[0]} of the exercise must be a text")
    if not exercise.name or not isinstance(exercise.card, Card):
        raise InputError(f"{path}: the exercise needs a name, and a card made with card_of(__doc__)")
    checks = exercise.checks(0)
    if not checks or not all(isinstance(check, GradeCheck) for check in checks):
        raise InputError(f"{path}: checks(seed) must return one GradeCheck or more, as a tuple")
    for check in checks:
        if check.measure is None and not check.beside:
            raise InputError(f"{path}: the check '{check.text}' needs measure=…, or a controller as beside=…")
        if check.points < 1:
            raise InputError(f"{path}: the check '{check.text}' must give one point or more")

"""Exercises: write the missing lines of a controller, and be judged by what it does.

One file per exercise, its docstring is its card; `starts/` has the file with the hole.
"""

from __future__ import annotations

from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from robots.errors import unknown_name

if TYPE_CHECKING:
    from lessons.exercises.exercise import Exercise

EXERCISES: dict[str, str] = {
    "joint-pd": "PD control with gravity compensation, joint by joint",
    "null-space": "OSF: a second task that leaves the first alone",
    "time-delay": "time-delay estimation: no model, and no load sags",
    "one-level-qp": "one level of the QP (35), one knot, with its bounds",
    "two-levels": "two levels with the equality (33)",
}
"""One line each, in the order in which to do them."""


def load_exercise(name: str) -> Exercise:
    """An exercise by its name. Raises InputError for a name that is none, naming the nearest."""
    if name not in EXERCISES:
        raise unknown_name("exercise", name, EXERCISES)
    found: Exercise = import_module(f"lessons.exercises.{name.replace('-', '_')}").EXERCISE
    return found


def exercises_of(lesson: str) -> tuple[Exercise, ...]:
    """Those a lesson leads to, in order."""
    return tuple(each for each in map(load_exercise, EXERCISES) if each.lesson == lesson)


def start_of(name: str) -> str:
    """The file with the hole in it. Raises InputError for a name that is none."""
    load_exercise(name)
    place = Path(str(files("lessons.exercises") / "starts" / f"{name.replace('-', '_')}.py"))
    return place.read_text(encoding="utf-8")

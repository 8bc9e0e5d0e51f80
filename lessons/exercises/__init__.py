"""Exercises: students write the missing lines of a controller, and the motion of the robot is graded.

Each exercise is one file, NAME.toml, which `read` reads. `starts/` contains the files with missing lines.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from robots.errors import unknown_name

if TYPE_CHECKING:
    from lessons.exercises.exercise import Exercise

EXERCISES: dict[str, str] = {
    "joint-pd": "PD control with gravity compensation, joint by joint",
    "null-space": "OSF: a second task that does not disturb the first",
    "time-delay": "time-delay estimation: hold an unknown load without a model",
    "one-level-qp": "one level of the QP (35), one knot, with its bounds",
    "two-levels": "two levels with the equality (33)",
    "distance-row": "rows that keep distances, above all levels",
}
"""The names of the exercises with a short description, in the recommended order."""


def load_exercise(name: str) -> Exercise:
    """Returns the exercise with this name. Raises InputError with the nearest valid name if there is none."""
    if name not in EXERCISES:
        raise unknown_name("exercise", name, EXERCISES)
    from lessons.exercises.read import read_exercise  # it loads the simulation, which names do not need

    return read_exercise(name)


def exercises_of(lesson: str) -> tuple[Exercise, ...]:
    """Returns the exercises that belong to a lesson, in order."""
    return tuple(exercise for exercise in map(load_exercise, EXERCISES) if exercise.lesson == lesson)


def start_of(name: str) -> str:
    """Returns the file with missing lines. Raises InputError if no exercise has this name."""
    load_exercise(name)
    path = Path(str(files("lessons.exercises") / "starts" / f"{name.replace('-', '_')}.py"))
    return path.read_text(encoding="utf-8")

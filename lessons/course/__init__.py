"""The lessons of the course, one per file; the docstring of each file is the card of its lesson.

Each file defines `LESSON`, and is imported when its lesson is first needed.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from robots.errors import unknown_name

if TYPE_CHECKING:
    from lessons.teaching.lesson import Lesson

COURSE: tuple[str, ...] = (
    "a-redundant-arm",
    "one-task",
    "no-model-needed",
    "two-tasks",
    "swap-the-priorities",
    "when-tasks-fight",
    "stretched-out",
    "torque-has-a-limit",
    "stopping-takes-distance",
    "a-blind-arm",
    "keeping-clear",
    "how-far-ahead",
    "deadlines",
    "sensors-are-coarse",
    "the-model-is-wrong",
    "inside-the-qp",
    "first-hold-then-reach",
    "how-strict-is-strict",
    "seeing-ahead",
    "deliveries",
    "told-wrong",
    "your-robot",
)
"""The lessons by name, in the recommended order."""


def load_lesson(name: str) -> Lesson:
    """Returns the lesson with this name. Raises InputError with the nearest name if there is none."""
    if name not in COURSE:
        raise unknown_name("lesson", name, COURSE)
    lesson: Lesson = import_module(f"lessons.course.{name.replace('-', '_')}").LESSON
    return lesson

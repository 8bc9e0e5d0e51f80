"""The lessons of the course, one Markdown file each; a file is read when its lesson is first needed."""

from __future__ import annotations

from functools import cache
from pathlib import Path
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
    """Returns the lesson with this name or title. Raises InputError with the nearest name if there is
    none."""
    return _read(name_of(name))


def name_of(words: str) -> str:
    """Returns the name of the lesson with this name or title. Raises InputError with the nearest name if
    there is none."""
    if words in COURSE:
        return words
    titles = {heading(name)[0].casefold(): name for name in COURSE}
    if words.casefold() not in titles:
        raise unknown_name("lesson", words, COURSE)
    return titles[words.casefold()]


def heading(name: str) -> tuple[str, str]:
    """Returns the title and the question of a lesson of the course. The lesson is not loaded, which needs its
    robot."""
    title, question, _ = lesson_file(name).read_text(encoding="utf-8").split("\n\n", 2)
    return title.removeprefix("# "), question


@cache
def _read(name: str) -> Lesson:
    from lessons.teaching.reader import read_lesson

    path = lesson_file(name)
    return read_lesson(name, str(path), path.read_text(encoding="utf-8"))


def lesson_file(name: str) -> Path:
    """Returns the file of a lesson of the course."""
    return Path(__file__).with_name(f"{name}.md")

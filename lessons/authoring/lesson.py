"""Loads a lesson by its name, or by the path of a file."""

from __future__ import annotations

from functools import lru_cache
from typing import NoReturn

from lessons.course import load_lesson
from lessons.own.files import Source, is_lesson, read
from lessons.runs.named import check_duration
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Lesson
from lessons.teaching.reader import assignments, read_lesson
from robots import InputError


def lesson_named(name: str) -> Lesson:
    """Returns a lesson by its name or file. Raises InputError if there is none, or the file cannot be
    used."""
    return lesson_of(read(name)) if is_lesson(name) else load_lesson(name)


@lru_cache(maxsize=64)
def lesson_of(source: Source) -> Lesson:
    """Returns the lesson of a file. A file is tested again only if its content has changed."""
    lesson = read_lesson(source.path, source.path, source.text)
    for number, step in enumerate(lesson.steps, start=1):
        try:
            check_duration(step.duration)
            lesson.run_of(step).prepared()
        except InputError as error:
            _refuse(lesson, source, number, error)
    return lesson


def _refuse(lesson: Lesson, source: Source, number: int, error: InputError) -> NoReturn:
    """Raises InputError with the place of the setting with which a step cannot be run; for any other
    reason, with the number of the step."""
    chosen: tuple[str, ...] = ()
    for step, location, setting in assignments(source.path, source.text):
        if step in (0, number):
            chosen = (*chosen, setting)
            try:
                RunSpec(lesson.scene, lesson.urdf, set=chosen).prepared()
            except InputError as fault:
                if len(chosen) > 1 or _runs(lesson):
                    raise InputError(f"{location}: {fault}") from None
    raise InputError(f"{source.path}: step {number}, '{lesson.steps[number - 1].title}': {error}") from None


def _runs(lesson: Lesson) -> bool:
    """Returns whether the scene of a lesson can be run without its settings."""
    try:
        RunSpec(lesson.scene, lesson.urdf).prepared()
    except InputError:
        return False
    return True

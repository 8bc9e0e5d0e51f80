"""Loads a lesson by its name, or by the path of a file."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from typing import get_args

from lessons.course import load_lesson
from lessons.own.files import Source, is_file, read
from lessons.own.kinds import expected
from lessons.runs.check import check_duration
from lessons.runs.named import called, module_of
from lessons.teaching.claim import Relation
from lessons.teaching.lesson import Lesson, Step
from robots import InputError


def lesson_named(name: str) -> Lesson:
    """Returns a lesson by its name or file. Raises InputError if there is none, or the file cannot be
    used."""
    return _lesson_of(read(name)) if is_file(name) else load_lesson(name)


@lru_cache(maxsize=64)
def _lesson_of(source: Source) -> Lesson:
    """Returns the lesson of a file. A file is tested again only if its content has changed."""
    module = module_of(source)
    expected(module, "lesson")
    found = vars(module)["LESSON"]
    if not isinstance(found, Lesson):
        raise InputError(f"{source.path}: LESSON is a {type(found).__name__}: make it with Lesson(…)")
    called(source, partial(check_lesson, found))
    return replace(found, name=source.path)


def check_lesson(lesson: Lesson) -> None:
    """Raises InputError, naming the step, for a lesson whose steps cannot be run."""
    if not lesson.steps:
        raise InputError("the lesson has no steps: give at least one Step(…)")
    for place, step in enumerate(lesson.steps, start=1):
        if not isinstance(step, Step):
            raise InputError(f"step {place} is a {type(step).__name__}: make it with Step(…)")
        try:
            check_duration(step.duration)
            lesson.run_of(step).prepared()
            for claim in step.claims:
                if claim.relation not in get_args(Relation):
                    raise InputError(
                        f"claim '{claim.text}': {claim.relation!r} is not a relation; choose one of "
                        f"{', '.join(get_args(Relation))}"
                    )
        except InputError as error:
            raise InputError(f"step {place}, '{step.title}': {error}") from None

"""Whether what a file defines can be used, before anything is shown of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, get_args

from lessons.events import Event
from lessons.scenes.scene import Scene
from robots import InputError
from robots.errors import shortened

if TYPE_CHECKING:
    from lessons.teaching.lesson import Lesson


def check_scene(scene: Scene) -> None:
    """Raises InputError for a scene that cannot begin, or one of whose events cannot happen; or whatever its
    own code raises."""
    from lessons.session.start import begin

    _check_duration(scene.duration)
    for each in scene.events:
        if not (isinstance(each, tuple) and len(each) == 2 and isinstance(each[1], get_args(Event))):
            raise InputError(
                f"an event is {shortened(repr(each), 80)}: give (seconds, event of lessons.events), e.g. "
                '(1.0, Push("link_3", force=(0.0, 5.0, 0.0)))'
            )
    make: Any = getattr(scene, "references", None)
    if make is not None:
        given = make(scene.robot, scene.settings.levels)
        names = [task.name for level in scene.settings.levels for task in level.tasks]
        if not isinstance(given, dict) or not given.keys() <= set(names):
            raise InputError(
                f"its references are {shortened(repr(given), 80)}: return a reference per task name, of "
                f"{', '.join(names)}"
            )
    session = begin(scene)
    for _, event in scene.events:
        session.post(event)
    session.drain()
    session.tick()
    if session.notices:
        raise InputError(session.notices[0])


def check_lesson(lesson: Lesson) -> None:
    """Raises InputError, naming the step, for a lesson whose steps cannot be run."""
    from lessons.teaching.claim import Relation
    from lessons.teaching.lesson import Step

    if not lesson.steps:
        raise InputError("the lesson has no steps: give at least one Step(…)")
    for place, step in enumerate(lesson.steps, start=1):
        if not isinstance(step, Step):
            raise InputError(f"step {place} is a {type(step).__name__}: make it with Step(…)")
        try:
            _check_duration(step.duration)
            lesson.run_of(step).prepared()
            for claim in step.claims:
                if claim.relation not in get_args(Relation):
                    raise InputError(
                        f"claim '{claim.text}': {claim.relation!r} is no relation; choose one of "
                        f"{', '.join(get_args(Relation))}"
                    )
        except InputError as error:
            raise InputError(f"step {place}, '{step.title}': {error}") from None


def _check_duration(seconds: Any) -> None:
    number = isinstance(seconds, (int, float)) and not isinstance(seconds, bool)
    if not (number and math.isfinite(seconds) and seconds > 0):
        raise InputError(f"duration is {shortened(repr(seconds), 40)}: give seconds, more than 0")

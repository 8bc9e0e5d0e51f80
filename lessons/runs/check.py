"""Checks the scene of a file before it is shown."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, get_args

from lessons.events import Event
from lessons.scenes.scene import Scene
from robots import InputError
from robots.errors import shortened


def check_scene(scene: Scene) -> None:
    """Raises InputError if a scene cannot begin or has an impossible event. Exceptions of the scene's own
    code are passed on."""
    from lessons.session.start import begin  # only here: to find a scene by name must load no controller

    check_duration(scene.duration)
    for entry in scene.events:
        if not (isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[1], get_args(Event))):
            raise InputError(
                f"an event is {shortened(repr(entry), 80)}: give (seconds, event of lessons.events), e.g. "
                '(1.0, Push("link_3", force=(0.0, 5.0, 0.0)))'
            )
    make: Any = getattr(scene, "references", None)
    if make is not None:
        references = make(scene.robot, scene.settings.levels)
        names = [task.name for level in scene.settings.levels for task in level.tasks]
        if not isinstance(references, dict) or not references.keys() <= set(names):
            raise InputError(
                f"its references are {shortened(repr(references), 80)}: return a dict of references by task "
                f"name; the tasks are {', '.join(names)}"
            )
    session = begin(replace(scene, events=()))
    for number, (_, event) in enumerate(scene.events, start=1):
        session.post(event)
        session.drain()
        if len(session.log) < number:
            raise InputError(session.notices[-1])
    session.notices.clear()  # the scene may show what happens with settings that a notice is about
    session.tick()
    if session.notices:
        raise InputError(session.notices[0])


def check_duration(seconds: Any) -> None:
    """Raises InputError unless `seconds` is a finite number above 0."""
    number = isinstance(seconds, (int, float)) and not isinstance(seconds, bool)
    if not (number and math.isfinite(seconds) and seconds > 0):
        raise InputError(f"duration is {shortened(repr(seconds), 40)}: give seconds, more than 0")

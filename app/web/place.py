"""The place of a page (its scene or step), stored in the browser. Another server at the same address can
continue from this place.

Every tab has its own storage, which remains after a reload and after the end of the server. viser reads only
the storage that all tabs share; a script copies the value there, under a key of this visit.
"""

from __future__ import annotations

import hashlib
import json

from app.adapter.names import STORED
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from lessons.course import COURSE
from robots import InputError

_KEY = "himpc-lab-place"


def asking(key: str) -> str:
    """Returns the script that makes the tab's value readable under `key`."""
    kept = f"sessionStorage.getItem({json.dumps(_KEY)})"
    return f'try {{ localStorage.setItem({json.dumps(STORED + key)}, {kept} ?? ""); }} catch {{}}'


def keeping(text: str) -> str:
    """Returns the script that stores the value in the tab."""
    return f"try {{ sessionStorage.setItem({json.dumps(_KEY)}, {json.dumps(text)}); }} catch {{}}"


def written(choice: SceneChoice, code: str, start: SceneChoice) -> str:
    """Returns the place of a page as text: the step of a lesson, or the code of the scene and its settings.
    code: "" if there is none, e.g. for an uploaded robot, which other servers do not have; start: the choice
    that new pages of this server show; only servers with the same start continue from the place."""
    place: dict[str, str | int] = {"start": _digest(start)}
    exercise = choice.exercise
    if exercise is not None:
        return json.dumps({**place, "lesson": exercise.lesson, "step": exercise.place + 1})
    return json.dumps({**place, "code": code}) if code else ""


def read(text: str | None, start: SceneChoice) -> SceneChoice | None:
    """Returns the choice that a tab stored; None if it cannot be loaded. The text is not trusted."""
    try:
        found = json.loads(text or "{}")
        if not isinstance(found, dict) or found.get("start") != _digest(start):
            return None
        lesson, step, code = found.get("lesson"), found.get("step"), found.get("code")
        if lesson in COURSE and type(step) is int:
            return SceneChoice.of_lesson(LessonPlace.at(str(lesson), step)).admitting(start)
        if not isinstance(code, str):
            return None
        from lessons.replay.state import decode

        return SceneChoice.of_state(decode(code)).admitting(start)
    except (InputError, ValueError, RecursionError, TypeError):
        return None


def _digest(start: SceneChoice) -> str:
    return hashlib.sha256(repr(start).encode()).hexdigest()[:16]

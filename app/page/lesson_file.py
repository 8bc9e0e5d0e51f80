"""The file of the user's own lesson. The page shows the saved version at the same step."""

from __future__ import annotations

import os
from dataclasses import replace

from app.link.choice import SceneChoice
from lessons.own.files import is_lesson
from robots import InputError

_Stamp = tuple[str, int, int]
"""Path, time and size of a file. If the stamp changes, the file was saved."""


class LessonFile:
    """Looks at the file whenever the page asks.

    Attributes:
        fault: what is wrong with the saved version, in one sentence; None if nothing is. The page continues
            to show the version before.
    """

    def __init__(self) -> None:
        self.fault: str | None = None
        self._stamp: _Stamp | None = None

    def saved(self, choice: SceneChoice) -> SceneChoice | None:
        """Returns the choice with the saved version of its lesson, if there is one that can be used."""
        place = choice.exercise
        stamp = None if place is None or not is_lesson(place.lesson) else _stamp(place.lesson)
        if place is None or stamp is None:
            if place is None or not is_lesson(place.lesson):
                self.fault = None
            return None
        before, self._stamp = self._stamp, stamp
        if before is None or before == stamp or before[0] != stamp[0]:
            return None
        try:
            new = choice.at(replace(place, text=None).opened)
        except InputError as error:
            self.fault = choice.without_places(f"{error}. The page shows the version before.")
            return None
        self.fault = None
        return None if new.exercise == place else new


def _stamp(path: str) -> _Stamp | None:
    """Returns the stamp of a file; None while there is no file, as for a moment while it is saved."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return path, found.st_mtime_ns, found.st_size

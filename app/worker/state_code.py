"""The state code of a running scene. The simulation makes it, as it has loaded the scene."""

from __future__ import annotations

from app.link.choice import SceneChoice
from lessons.replay.state import encode, state_of
from lessons.settings.settings import SceneSettings
from robots import InputError


class StateCode:
    """Makes the codes of one scene. before: the settings of the scene before any assignment; None if they are
    not known."""

    def __init__(self, choice: SceneChoice, before: SceneSettings | None) -> None:
        self._choice, self.before = choice, before
        self._made: SceneSettings | None = None  # the settings of the last code

    def of(self, settings: SceneSettings) -> str:
        """Returns the code of the scene with these settings; "" if there is none, e.g. for an uploaded robot.
        Loads nothing."""
        self._made, choice = settings, self._choice
        if self.before is None or choice.urdf_text is not None:
            return ""
        exercise = choice.exercise
        lesson, step = (None, None) if exercise is None else (exercise.lesson, exercise.place + 1)
        try:
            return encode(state_of(choice.run, settings, lesson=lesson, step=step, before=self.before))
        except InputError:
            return ""

    def news(self, settings: SceneSettings) -> str | None:
        """As `of`; None if these are the settings of the last code."""
        return None if settings is self._made else self.of(settings)

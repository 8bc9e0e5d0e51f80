"""What following a lesson asks of both kinds of sessions and settings."""

from __future__ import annotations

from typing import Any

from lessons.control import Control
from lessons.kinds import AnyScene, AnySession, AnySettings, changed_any
from lessons.mobile.session import MobileSession
from lessons.mobile.settings import value_at as mobile_value_at
from lessons.scene import Scene
from lessons.session import Session
from lessons.settings import SceneSettings, value_at


def session_of(scene: AnyScene, seed: int) -> AnySession:
    """A scene from its beginning. Raises InputError if its settings do not fit its robot."""
    return Session(scene, seed) if isinstance(scene, Scene) else MobileSession(scene, seed)


def mission_over(session: AnySession) -> bool:
    """Whether there is nothing left to do, which ends a headless run."""
    return isinstance(session, MobileSession) and session.progress.done


def setting_at(settings: AnySettings, path: str) -> Any:
    """The value at a path of a lesson's control; of a weight of all levels the first one's."""
    if path in ("Q", "R"):
        return getattr(settings.levels[0], path)
    if isinstance(settings, SceneSettings):
        return value_at(settings, path)
    return mobile_value_at(settings, path)


def chosen(settings: AnySettings, control: Control) -> Any:
    """Which of a control's choices the settings have: the one that would change nothing; None if none is."""
    fitting = (each for each in control.choices if changed_any(settings, control.path, each) == settings)
    return next(fitting, None)


def within(settings: AnySettings, control: Control) -> bool:
    """Whether a setting stands where its control could have put it."""
    if control.choices:
        return chosen(settings, control) is not None
    return control.takes(setting_at(settings, control.path))

"""What following a lesson asks of both kinds of sessions and settings."""

from __future__ import annotations

from typing import Any

from lessons.kinds import AnyScene, AnySession, AnySettings
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

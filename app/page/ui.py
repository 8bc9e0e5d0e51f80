"""The user interface for each kind of scene: its panels, plots and objects in the 3D view."""

from __future__ import annotations

from collections.abc import Callable

from app.page.scene_ui import Context, Face
from app.page.torque_ui import TorqueFace
from app.page.velocity_ui import VelocityFace
from lessons.settings.settings import SceneSettings
from lessons.settings.torque import TorqueSettings
from lessons.settings.velocity import VelocitySettings

__all__ = ["Context", "Face", "face_for"]

_FACES: dict[type[SceneSettings], Callable[[Context], Face]] = {
    TorqueSettings: TorqueFace,
    VelocitySettings: VelocityFace,
}


def face_for(context: Context) -> Face:
    """Returns the user interface for the kind of scene that is loaded."""
    return _FACES[type(context.ready.settings)](context)

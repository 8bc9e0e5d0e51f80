"""What each kind of scene brings to the page: its panels, plots and things in the 3D view."""

from __future__ import annotations

from app.page.scene_ui import Context, Face
from app.page.torque_ui import TorqueFace
from app.page.velocity_ui import VelocityFace
from lessons.settings.torque import TorqueSettings

__all__ = ["Context", "Face", "face_for"]


def face_for(context: Context) -> Face:
    """The face of the kind of scene that is loaded."""
    torque = isinstance(context.ready.settings, TorqueSettings)
    return TorqueFace(context) if torque else VelocityFace(context)

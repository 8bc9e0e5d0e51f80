"""What each kind of scene brings to the page: its panels, plots and things in the 3D view."""

from app.faces.face import Context, Face
from app.faces.torque import TorqueFace

__all__ = ["Context", "Face", "face_for"]


def face_for(context: Context) -> Face:
    """The face of the kind of scene that is loaded."""
    return TorqueFace(context)

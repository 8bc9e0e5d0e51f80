"""References: desired motions with a preview over the horizon."""

from himpc.references.curves import Circle, FigureEight, Hold, Phase, Sinusoid
from himpc.references.outlook import Outlook
from himpc.references.path import LAWS, Law, Path, SquareWave, Waypoints
from himpc.references.preview import Preview, Reference, previews
from himpc.references.shifted import Later, Started
from himpc.references.target import JOINT_CAPS, POSITION_CAPS, ROTATION_CAPS, Caps, Target

__all__ = [
    "JOINT_CAPS",
    "LAWS",
    "POSITION_CAPS",
    "ROTATION_CAPS",
    "Caps",
    "Circle",
    "FigureEight",
    "Hold",
    "Later",
    "Law",
    "Outlook",
    "Path",
    "Phase",
    "Preview",
    "Reference",
    "Sinusoid",
    "SquareWave",
    "Started",
    "Target",
    "Waypoints",
    "previews",
]

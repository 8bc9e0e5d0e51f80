"""References: desired motions with a preview over the horizon."""

from himpc.references.clocks import Started
from himpc.references.curves import Circle, FigureEight, Sinusoid
from himpc.references.hold import Hold
from himpc.references.later import Later
from himpc.references.outlook import Outlook
from himpc.references.path import LAWS, Law, Path, segment
from himpc.references.phase import Phase
from himpc.references.preview import Preview, Reference, previews
from himpc.references.square_wave import SquareWave
from himpc.references.target import JOINT_CAPS, POSITION_CAPS, ROTATION_CAPS, Caps, Target
from himpc.references.waypoints import Waypoints

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
    "segment",
]

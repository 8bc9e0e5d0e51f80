"""Tasks: the quantities that a level controls."""

from himpc.tasks.centre_of_mass import CentreOfMass
from himpc.tasks.frame_orientation import FrameOrientation
from himpc.tasks.frame_position import FramePosition
from himpc.tasks.joints import Damping, Joints, Posture
from himpc.tasks.kinds import KINDS, Kind
from himpc.tasks.orientation import OrientationTask
from himpc.tasks.plane_distance import PlaneDistance
from himpc.tasks.pointing import Pointing
from himpc.tasks.relative import RelativeOrientation, RelativePosition
from himpc.tasks.task import Task

__all__ = [
    "KINDS",
    "CentreOfMass",
    "Damping",
    "FrameOrientation",
    "FramePosition",
    "Joints",
    "Kind",
    "OrientationTask",
    "PlaneDistance",
    "Pointing",
    "Posture",
    "RelativeOrientation",
    "RelativePosition",
    "Task",
]

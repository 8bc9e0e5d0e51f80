"""Tasks: the quantities that a level controls."""

from himpc.tasks.joints import Damping, Joints, Posture
from himpc.tasks.kinds import KINDS, Kind
from himpc.tasks.orientation import FrameOrientation, OrientationTask
from himpc.tasks.pointing import Pointing
from himpc.tasks.position import CentreOfMass, FramePosition, PlaneDistance
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

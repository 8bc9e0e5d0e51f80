"""How a robot is controlled: tasks, limits, prediction, the cascade of QPs, controllers."""

from himpc.controllers import CONTROLLERS, HIMPC, Settings
from himpc.htmpc import HTMPC, HTMPCSettings
from himpc.limits import Limits
from himpc.plan import Plan
from himpc.stack import Level, Stack
from himpc.tasks import Damping, FrameOrientation, FramePosition, Joints, Posture

__all__ = [
    "CONTROLLERS",
    "HIMPC",
    "HTMPC",
    "Damping",
    "FrameOrientation",
    "FramePosition",
    "HTMPCSettings",
    "Joints",
    "Level",
    "Limits",
    "Plan",
    "Posture",
    "Settings",
    "Stack",
]

"""Control of a robot: tasks, limits, prediction, the cascade of QPs, and the controllers."""

from typing import TYPE_CHECKING

from robots.lazy import lazily

if TYPE_CHECKING:
    from himpc.catalog import CONTROLLERS
    from himpc.controllers import HIMPC, Settings
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

__getattr__ = lazily("himpc")

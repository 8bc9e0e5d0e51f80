"""Hierarchical-task MPC: velocity-level control of mobile manipulators (the HTMPC paper, RA-L 2024)."""

from typing import TYPE_CHECKING

from robots.lazy import lazily

if TYPE_CHECKING:
    from himpc.htmpc.htidkc import HTIDKC
    from himpc.htmpc.htmpc import HTMPC, HTMPC_WPT, STMPC
    from himpc.htmpc.placo_control import Placo
    from himpc.htmpc.plan import LevelEvidence, VelocityPlan
    from himpc.htmpc.settings import (
        FORMULATIONS,
        LEXICOGRAPHIC,
        HTMPCSettings,
        MotionBounds,
        MotionLimits,
        base_joints,
        bounds,
    )

__all__ = [
    "FORMULATIONS",
    "HTIDKC",
    "HTMPC",
    "HTMPC_WPT",
    "LEXICOGRAPHIC",
    "STMPC",
    "HTMPCSettings",
    "LevelEvidence",
    "MotionBounds",
    "MotionLimits",
    "Placo",
    "VelocityPlan",
    "base_joints",
    "bounds",
]

__getattr__ = lazily("himpc.htmpc")

"""Hierarchical-task MPC: velocity-level control of mobile manipulators (the HTMPC paper, RA-L 2024)."""

from typing import TYPE_CHECKING

from robots.lazy import lazily

if TYPE_CHECKING:
    from himpc.htmpc.base import G, base_joints
    from himpc.htmpc.htidkc import HTIDKC
    from himpc.htmpc.htmpc import HTMPC
    from himpc.htmpc.placo_control import Placo
    from himpc.htmpc.plan import LevelEvidence, VelocityPlan
    from himpc.htmpc.settings import (
        FORMULATIONS,
        LEXICOGRAPHIC,
        HTMPCSettings,
        MotionBounds,
        MotionLimits,
        bounds,
    )
    from himpc.htmpc.stmpc import HTMPC_WPT, STMPC

__all__ = [
    "FORMULATIONS",
    "HTIDKC",
    "HTMPC",
    "HTMPC_WPT",
    "LEXICOGRAPHIC",
    "STMPC",
    "G",
    "HTMPCSettings",
    "LevelEvidence",
    "MotionBounds",
    "MotionLimits",
    "Placo",
    "VelocityPlan",
    "base_joints",
    "bounds",
]

__getattr__ = lazily(
    "himpc.htmpc",
    {
        "FORMULATIONS": "settings",
        "HTIDKC": "htidkc",
        "HTMPC": "htmpc",
        "HTMPC_WPT": "stmpc",
        "LEXICOGRAPHIC": "settings",
        "STMPC": "stmpc",
        "MotionBounds": "settings",
        "G": "base",
        "HTMPCSettings": "settings",
        "LevelEvidence": "plan",
        "MotionLimits": "settings",
        "Placo": "placo_control",
        "VelocityPlan": "plan",
        "base_joints": "base",
        "bounds": "settings",
    },
)

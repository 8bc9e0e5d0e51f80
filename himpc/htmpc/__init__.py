"""Hierarchical-task MPC: velocity-level control of mobile manipulators (the HTMPC paper, RA-L 2024)."""

from himpc.htmpc.htidkc import HTIDKC
from himpc.htmpc.htmpc import HTMPC
from himpc.htmpc.kinematics import G, base_joints
from himpc.htmpc.plan import LevelEvidence, VelocityPlan
from himpc.htmpc.settings import FORMULATIONS, LEXICOGRAPHIC, Bounds, HTMPCSettings, MotionLimits, bounds
from himpc.htmpc.stmpc import HTMPC_WPT, STMPC

__all__ = [
    "FORMULATIONS",
    "HTIDKC",
    "HTMPC",
    "HTMPC_WPT",
    "LEXICOGRAPHIC",
    "STMPC",
    "Bounds",
    "G",
    "HTMPCSettings",
    "LevelEvidence",
    "MotionLimits",
    "VelocityPlan",
    "base_joints",
    "bounds",
]

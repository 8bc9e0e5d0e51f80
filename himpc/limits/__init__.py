"""Limits: torque, velocity and position bounds, and the rows they become."""

from himpc.limits.limits import POSITION_MARGIN, Limits, LimitsInForce, in_force
from himpc.limits.ramp import ramp
from himpc.limits.rows import Rows, build_rows, reaction
from himpc.limits.viability import viability_bounds

__all__ = [
    "POSITION_MARGIN",
    "Limits",
    "LimitsInForce",
    "Rows",
    "build_rows",
    "in_force",
    "ramp",
    "reaction",
    "viability_bounds",
]

"""Limits: which of them are imposed, their constraints, and the rows of these constraints."""

from himpc.limits.constraints import CONSTRAINTS
from himpc.limits.limits import POSITION_MARGIN, Limits, LimitsInForce, in_force
from himpc.limits.position import POSITION
from himpc.limits.ramp import ramp
from himpc.limits.rows import Rows, build_rows
from himpc.limits.torque import TORQUE
from himpc.limits.torque_rate import TORQUE_RATE
from himpc.limits.velocity import VELOCITY, reaction, viability_bounds

__all__ = [
    "CONSTRAINTS",
    "POSITION",
    "POSITION_MARGIN",
    "TORQUE",
    "TORQUE_RATE",
    "VELOCITY",
    "Limits",
    "LimitsInForce",
    "Rows",
    "build_rows",
    "in_force",
    "ramp",
    "reaction",
    "viability_bounds",
]

"""All constraints."""

from __future__ import annotations

from himpc.limits.constraint import Constraint
from himpc.limits.distance import DISTANCE
from himpc.limits.limits import Limits
from himpc.limits.position import POSITION
from himpc.limits.torque import TORQUE
from himpc.limits.torque_rate import TORQUE_RATE
from himpc.limits.velocity import VELOCITY

CONSTRAINTS: tuple[Constraint, ...] = (
    TORQUE,
    VELOCITY,
    POSITION,
    TORQUE_RATE,
    DISTANCE,
)
"""All constraints, in the order of their rows. Index k has bit 2ᵏ in telemetry's `at_bound`."""


def imposed(limits: Limits) -> tuple[Constraint, ...]:
    """Returns the constraints that have rows under these limits."""
    return tuple(constraint for constraint in CONSTRAINTS if constraint.is_on(limits))


def bit_of(constraint: Constraint) -> int:
    """Returns the bit of a constraint in `at_bound`; 0 if it is not among `CONSTRAINTS`."""
    return 1 << CONSTRAINTS.index(constraint) if constraint in CONSTRAINTS else 0

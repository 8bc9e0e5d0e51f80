"""A limit on the rate of each joint's torque, which drives and robot interfaces impose."""

from __future__ import annotations

import numpy as np

from himpc.limits.constraint import Block, Constraint, Moment


def _bounds(now: Moment) -> Block:
    """Returns the bounds |Δτ_j| ≤ rate · T_s at every knot."""
    step = np.full((now.N, now.tau_0.size), now.limits.torque_rate * now.T_s)
    return Block(-step, step)


TORQUE_RATE = Constraint(
    "torque rate",
    np.eye,
    first_knot=0,
    hard=True,
    is_on=lambda limits: limits.torque_rate > 0,
    bounds=_bounds,
)

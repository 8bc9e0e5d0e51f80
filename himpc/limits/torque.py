"""The torque limits (32f)."""

from __future__ import annotations

import numpy as np

from himpc.limits.constraint import Block, Constraint, Moment, lags
from robots.arrays import Array


def summed(N: int) -> Array:
    """Returns the (N, N) profile of torque rows. The torque relative to τ₀ is the sum of the increments so
    far."""
    return np.where(lags(N) >= 0, 1.0, 0.0)


def _bounds(now: Moment) -> Block:
    lower, upper = np.repeat((now.force.torque - now.tau_0)[:, None], now.N, axis=1)
    return Block(lower, upper)


# If the limits are off, the rows exist without bounds.
TORQUE = Constraint("torque", summed, first_knot=0, hard=True, is_on=lambda _: True, bounds=_bounds)

"""The position limits (32d) as printed."""

from __future__ import annotations

import numpy as np

from himpc.limits.constraint import Block, Constraint, Moment, lags
from robots.arrays import Array


def summed_thrice(N: int) -> Array:
    """Returns the (N, N) profile of position rows. The position at the next knot, scaled by M̄/T_s², is the
    sum of the velocities at the knots before. No increment changes the position at knot 1."""
    lag = lags(N)
    return np.where(lag >= 0, lag * (lag + 1.0) / 2.0, 0.0)


def _bounds(now: Moment) -> Block:
    scale = now.M_bar / now.T_s
    q = np.array((now.force.q_lower, now.force.q_upper))[:, None]
    lower, upper = (q - now.state.free_position(now.N, now.T_s)) * (scale / now.T_s)
    return Block(lower, upper)


POSITION = Constraint(
    "position",
    summed_thrice,
    first_knot=1,
    hard=False,
    is_on=lambda limits: limits.position == "paper",
    bounds=_bounds,
)

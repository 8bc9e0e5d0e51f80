"""The velocity limits (32e), and the velocity from which a joint can still stop before its position limit."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from himpc.limits.constraint import Block, Constraint, Moment, lags
from himpc.limits.limits import Limits
from himpc.limits.viability import viability_bounds

Array = NDArray[np.float64]

REACTION = 5.0
"""The reaction time that the viability bound assumes is one period plus this number of time constants of the
velocity barrier."""


def reaction(limits: Limits, T_s: float) -> float:
    """Returns the reaction time, s, that the viability bound assumes before a joint brakes. T_s is the
    control period, s."""
    return T_s + (REACTION / limits.velocity_approach if limits.velocity_approach else 0.0)


@lru_cache(maxsize=64)
def approached(N: int, share: float) -> Array:
    """Returns the largest shares of the distance to a velocity bound by which a joint may approach the bound
    until knots 1 … N, (N, 1). `share` is the share for one period; 0 means no limit, and the result is 1."""
    return 1.0 - np.asarray((1.0 - min(1.0, share or 1.0)) ** np.arange(1.0, N + 1)[:, None], np.float64)


def summed_twice(N: int) -> Array:
    """Returns the (N, N) profile of velocity rows. The velocity at the next knot, scaled by M̄/T_s, is the
    sum of the torques so far."""
    lag = lags(N)
    return np.where(lag >= 0, lag + 1.0, 0.0)


def _bounds(now: Moment) -> Block:
    state, limits, force, N, T_s = now.state, now.limits, now.force, now.N, now.T_s
    stopping = None
    if limits.position == "viability":
        v = viability_bounds(state.q, *force.stops, force.v_limit, force.a_max, reaction(limits, T_s))
        stopping = np.array((-v[0] < force.v_limit, v[1] < force.v_limit))
    else:
        v = np.array((-force.v_limit, force.v_limit))
    scale = now.M_bar / T_s
    bounds = np.empty((2, N, state.q.size))
    np.multiply(approached(N, limits.velocity_approach * T_s), ((v - state.v) * scale)[:, None], out=bounds)
    bounds -= state.gained_velocity(N, T_s) * scale
    return Block(bounds[0], bounds[1], stopping=stopping)


VELOCITY = Constraint(
    "velocity", summed_twice, first_knot=1, hard=False, is_on=lambda _: True, bounds=_bounds
)

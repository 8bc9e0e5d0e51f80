"""The velocity limits (32e), and the velocity from which a joint can still stop before its position limit."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from himpc.constants import RETURN_RATE
from himpc.limits.constraint import Block, Constraint, Moment, lags
from himpc.limits.limits import Limits
from robots.arrays import Array


def viability_bounds(
    q: Array, q_lower: Array, q_upper: Array, v_limit: Array, a_max: Array, reaction: float
) -> Array:
    """Returns bounds on q̇_{k+1}. A joint inside these bounds can still stop with a_max before its position
    limit.

    The upper bound is q̇_{k+1} ≤ min(q̇_max, a(−t + √(t² + 2 max(0, q_max − q_k)/a))); the lower bound is its
    mirror image. A joint at this speed stops exactly at the limit, with the reaction time t and then the
    deceleration a. t = T_s is enough for a joint that may brake at once. The braking begins later if velocity
    rows bound the change of the speed. Beyond a limit the joint must return: the bound is then −RETURN_RATE
    times the excess. The printed position rows (32d) cannot ensure a stop: an N·T_s of 5 ms is far shorter
    than the time that a joint needs to stop.

    Args:
        q: measured positions, (n,) rad.
        q_lower, q_upper: position limits, (n,), ±inf where there is none.
        v_limit: velocity limit, (n,) rad/s, inf where there is none.
        a_max: the assumed deceleration, (n,) rad/s².
        reaction: time t before the joint brakes, ≥ T_s, s.

    Returns:
        lower and upper bound on the velocity, (2, n), lower ≤ upper.
    """
    room = np.empty((2, q.size))
    np.subtract(q, q_lower, out=room[0])
    np.subtract(q_upper, q, out=room[1])
    inside = np.maximum(room, 0.0) if float(room.min()) < 0.0 else room
    reach = np.minimum(v_limit, a_max * (np.sqrt(reaction**2 + (2.0 / a_max) * inside) - reaction))
    if inside is not room:
        reach += np.maximum(RETURN_RATE * np.minimum(room, 0.0), -v_limit)
        np.negative(reach[0], out=reach[0])
        reach.sort(axis=0)
    else:
        np.negative(reach[0], out=reach[0])
    return reach


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

"""The velocity from which a joint can still stop before its limit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.constants import RETURN_RATE

Array = NDArray[np.float64]


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

"""The velocity from which a joint can still stop before its limit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.constants import RETURN_RATE

Array = NDArray[np.float64]


def viability_bounds(
    q: Array, q_lower: Array, q_upper: Array, v_limit: Array, a_max: Array, reaction: float
) -> Array:
    """Bounds on q̇_{k+1} that keep a stop with a_max before the position limit possible.

    q̇_{k+1} ≤ min(q̇_max, a(−t + √(t² + 2 max(0, q_max − q_k)/a))) and its mirror: the speed whose stop,
    with t of reaction and then a, ends at the limit. t = T_s is enough for a joint that may brake at once;
    velocity rows that bound the change of the speed delay it. Beyond a limit the joint must return: the bound
    turns into −RETURN_RATE times the excess. Printed position rows
    (32d) cannot do this: an N·T_s of 5 ms is far shorter than the time a joint needs to stop.

    Args:
        q: measured positions, (n,) rad.
        q_lower, q_upper: position limits, (n,), ±inf where there is none.
        v_limit: velocity limit, (n,) rad/s, inf where there is none.
        a_max: deceleration counted on, (n,) rad/s².
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

"""The velocity from which a joint can still stop before its limit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RETURN_RATE = 5.0
"""1/s: a joint beyond its limit is asked to come back at this rate times the excess."""


def viability_bounds(
    q: Array, q_lower: Array, q_upper: Array, v_limit: Array, a_max: Array, T_s: float
) -> Array:
    """Bounds on q̇_{k+1} that keep a stop with a_max before the position limit possible.

    q̇_{k+1} ≤ min(q̇_max, a(−T_s + √(T_s² + 2 max(0, q_max − q_k)/a))) and its mirror. Beyond a limit
    the joint must return: the bound turns into −RETURN_RATE times the excess. Printed position rows
    (32d) cannot do this: an N·T_s of 5 ms is far shorter than the time a joint needs to stop.

    Args:
        q: measured positions, (n,) rad.
        q_lower, q_upper: position limits, (n,), ±inf where there is none.
        v_limit: velocity limit, (n,) rad/s, inf where there is none.
        a_max: deceleration counted on, (n,) rad/s².
        T_s: control period, s.

    Returns:
        lower and upper bound on the velocity, (2, n), lower ≤ upper.
    """
    room = np.stack((q - q_lower, q_upper - q))
    reach = np.minimum(v_limit, a_max * (np.sqrt(T_s * T_s + (2.0 / a_max) * np.maximum(room, 0.0)) - T_s))
    if float(room.min()) < 0.0:
        reach += np.maximum(RETURN_RATE * np.minimum(room, 0.0), -v_limit)
    np.negative(reach[0], out=reach[0])
    if (reach[0] > reach[1]).any():
        reach.sort(axis=0)
    return reach

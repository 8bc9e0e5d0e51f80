"""Lower velocity limits for joints that accelerate towards them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.constants import LEAD, LEAST_WHILE_FASTER, MEAN_SECONDS
from himpc.limits.limits import LimitsInForce

Array = NDArray[np.float64]


def followed(before: Array, v: Array, T_s: float) -> Array:
    """Returns the mean velocity of each joint one period later, (n,) rad/s.

    Args:
        before: one period ago.
        v: measured, (n,) rad/s.
        T_s: s.
    """
    return before + min(1.0, T_s / MEAN_SECONDS) * (v - before)


def anticipated(limits: LimitsInForce, v: Array, mean: Array) -> LimitsInForce:
    """The limits in force with lower velocities of joints that become faster.

    The rows of velocity are those of a joint whose acceleration follows its torque at once. With time-delay
    estimation it follows with a time constant of T_s times true over assumed inertia, 0.07 s for the third
    joint of a panda: all rows are met, and the joint that the motion of others accelerates overruns its limit
    by 36 %. Its limit is lower here until it has stopped becoming faster.

    Args:
        limits: in force.
        v: measured, (n,) rad/s.
        mean: see `followed`.
    """
    speed = np.abs(v)
    gained = (LEAD / MEAN_SECONDS) * (speed - np.abs(mean))
    if (speed + gained <= LEAST_WHILE_FASTER * limits.v_limit).all():
        return limits
    return limits.with_velocities(
        np.maximum(limits.v_limit - np.maximum(gained, 0.0), LEAST_WHILE_FASTER * limits.v_limit)
    )

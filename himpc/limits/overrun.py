"""Lowers the velocity limits of joints that accelerate towards these limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.constants import LEAD, LEAST_WHILE_FASTER, MEAN_SECONDS
from himpc.limits.limits import LimitsInForce

Array = NDArray[np.float64]


def followed(before: Array, v: Array, T_s: float) -> Array:
    """Returns the mean velocity of each joint one period later, (n,) rad/s.

    Args:
        before: the mean velocity one period ago, (n,) rad/s.
        v: measured velocity, (n,) rad/s.
        T_s: control period, s.
    """
    return before + min(1.0, T_s / MEAN_SECONDS) * (v - before)


def anticipated(limits: LimitsInForce, v: Array, mean: Array) -> LimitsInForce:
    """Returns the limits in force, with lower velocity limits for joints that become faster. The rows of
    velocity assume that a joint's acceleration follows its torque at once. With time-delay estimation the
    acceleration follows with a time constant of T_s times the ratio of true to assumed inertia, 0.07 s for
    the third joint of a panda. All rows are then satisfied, but a joint that is accelerated by the motion of
    other joints overruns its limit by 36 %. This function lowers the limit of such a joint until its speed no
    longer increases.

    Args:
        limits: the limits in force.
        v: measured velocity, (n,) rad/s.
        mean: the result of `followed`.
    """
    speed = np.abs(v)
    gained = (LEAD / MEAN_SECONDS) * (speed - np.abs(mean))
    if (speed + gained <= LEAST_WHILE_FASTER * limits.v_limit).all():
        return limits
    return limits.with_velocities(
        np.maximum(limits.v_limit - np.maximum(gained, 0.0), LEAST_WHILE_FASTER * limits.v_limit)
    )

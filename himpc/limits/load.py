"""Lowers the velocity limits of all joints that are carried by a motor close to its torque limit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.constants import FREE_LOAD, FULL_LOAD, LOAD_SECONDS, SLOWEST_SHARE
from himpc.limits.limits import LimitsInForce

Array = NDArray[np.float64]


def loaded(before: Array, tau: Array, limits: LimitsInForce, T_s: float) -> Array:
    """Returns the mean load of each joint one period later, (n,), as a share of its torque limit.

    Args:
        before: the mean load one period ago, (n,).
        tau: torque that acts, (n,) N·m.
        limits: the limits in force.
        T_s: control period, s.
    """
    share = np.abs(tau) / limits.largest_torque
    return before + min(1.0, T_s / LOAD_SECONDS) * (share - before)


def spared(limits: LimitsInForce, load: Array, carried: NDArray[np.bool_]) -> LimitsInForce:
    """Returns the limits in force with lower velocity limits for the joint of a loaded motor and for all
    joints that this motor carries.

    The torque that a motor needs to hold the robot depends on the posture. The less torque is left, the more
    slowly the robot approaches a posture that the motor cannot hold.

    Args:
        limits: the limits in force.
        load: the result of `loaded`.
        carried: (n, n), entry [k, j]: whether the motor of joint j carries joint k; true for k = j.
    """
    if load.max() <= FREE_LOAD:
        return limits
    share = np.clip((FULL_LOAD - load) / (FULL_LOAD - FREE_LOAD), SLOWEST_SHARE, 1.0)
    return limits.with_velocities(np.where(carried, share, 1.0).min(axis=1) * limits.v_limit)

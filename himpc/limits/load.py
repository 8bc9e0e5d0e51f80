"""Lowers the velocity limits of joints that are carried by a motor with little torque left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from himpc.limits.limits import LimitsInForce

Array = NDArray[np.float64]

_SECONDS = 0.1
"""Time constant of the mean load: a short peak of torque slows nothing down."""
_FREE, _MOST = 0.55, 0.95
"""Shares of the torque limit: below the first, a motor slows nothing down; above the second, its joints have
their lowest limit."""
_SLOWEST = 0.03
"""The lowest limit, as a share of the joint's own velocity limit."""
HEAVY = 0.85
"""If a motor has at least this load and the tasks make no progress, the robot counts as stalled."""


def loaded(before: Array, tau: Array, limits: LimitsInForce, T_s: float) -> Array:
    """Returns the mean load of each joint one period later, (n,), as a share of its torque limit.

    Args:
        before: one period ago.
        tau: torque that acts, (n,) N·m.
        limits: in force.
        T_s: s.
    """
    share = np.abs(tau) / limits.largest_torque
    return before + min(1.0, T_s / _SECONDS) * (share - before)


def spared(limits: LimitsInForce, load: Array, carried: NDArray[np.bool_]) -> LimitsInForce:
    """Returns the limits in force with lower velocity limits for the joint of a loaded motor and for all
    joints that this motor carries.

    The torque that a motor needs to hold the robot depends on the posture. The less torque is left, the more
    slowly the robot approaches a posture that the motor cannot hold.

    Args:
        limits: in force.
        load: see `loaded`.
        carried: (n, n), entry [k, j]: whether the motor of joint j carries joint k; true for k = j.
    """
    if load.max() <= _FREE:
        return limits
    share = np.clip((_MOST - load) / (_MOST - _FREE), _SLOWEST, 1.0)
    return replace(limits, v_limit=np.where(carried, share, 1.0).min(axis=1) * limits.v_limit)

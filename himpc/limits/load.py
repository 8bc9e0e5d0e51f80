"""Lower velocity limits for joints that a motor with little torque left carries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from himpc.limits.limits import LimitsInForce

Array = NDArray[np.float64]

_SECONDS = 0.1
"""Time constant of the mean load: the torque of a moment is no reason to slow down."""
_FREE, _MOST = 0.55, 0.95
"""Shares of the torque limit: up to the first a motor slows nothing down, from the second on joints are
slowest."""
_SLOWEST = 0.03
"""Share of its velocity limit that a joint keeps."""
HEAVY = 0.85
"""Load of a motor from which a robot whose tasks make no progress is stalled: the motor is in the way."""


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
    """The limits in force with lower velocities of the joints that a loaded motor carries, its own too.

    What a motor holds still depends on the posture. Where its velocity vanishes with the torque that is left,
    a robot does not come to a posture that the motor cannot hold.

    Args:
        limits: in force.
        load: see `loaded`.
        carried: (n, n) whether the motor of joint j, a column, carries joint k, a row, or is its motor.
    """
    if load.max() <= _FREE:
        return limits
    share = np.clip((_MOST - load) / (_MOST - _FREE), _SLOWEST, 1.0)
    return replace(limits, v_limit=np.where(carried, share, 1.0).min(axis=1) * limits.v_limit)

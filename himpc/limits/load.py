"""Lower velocity limits for joints whose motors have little torque left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from himpc.limits.limits import LimitsInForce

Array = NDArray[np.float64]

_SECONDS = 0.1
"""Time constant of the mean load: the torque of a moment is no reason to slow down."""
_RESERVE = 0.3
"""Share of the torque limit below which what is left slows a joint down."""
_SLOWEST = 0.15
"""Share of its velocity limit that a joint keeps."""


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


def spared(limits: LimitsInForce, load: Array) -> LimitsInForce:
    """The limits in force with lower velocities of joints that are loaded."""
    if load.max() <= 1.0 - _RESERVE:
        return limits
    share = np.clip((1.0 - load) / _RESERVE, _SLOWEST, 1.0)
    return replace(limits, v_limit=share * limits.v_limit)

"""The compiled braking motion to rest."""

from __future__ import annotations

import math

from himpc.compilation.compiled import GIVEN_VECTOR, MATRIX, NUMBER, kernel
from robots.arrays import Array

_NO_JERK_BOUND = 1e9
"""Replaces an infinite jerk bound: infinity times a speed of zero would be NaN."""


@kernel(
    *(GIVEN_VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, NUMBER, NUMBER),
    *(GIVEN_VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, MATRIX),
)
def brake(
    q_0: Array,
    v_0: Array,
    u_0: Array,
    dt: float,
    period: float,
    q_lower: Array,
    q_upper: Array,
    v_max: Array,
    a_max: Array,
    j_max: Array,
    U: Array,
) -> None:
    """See `continuing.braking`; U (N, n) is the result."""
    for i in range(len(q_0)):
        q, v, u = q_0[i], v_0[i], u_0[i]
        speed = min(0.2 * v_max[i], 1.0)
        for k in range(len(U)):
            excess = max(q - q_upper[i], 0.0) - max(q_lower[i] - q, 0.0)
            step = j_max[i] * (min(period, dt) if k == 0 else dt)
            # With a jerk bound, the end of the braking takes time. With u = √(2j|v|), speed and input reach
            # zero at the same time.
            gap = min(max(-excess / (5.0 * dt), -speed), speed) - v
            most = min(a_max[i], 0.7 * math.sqrt(2.0 * min(j_max[i], _NO_JERK_BOUND) * abs(gap)))
            u = min(max(min(max(gap / dt, -most), most), u - step), u + step)
            q, v = q + dt * v + 0.5 * dt * dt * u, v + dt * u
            U[k, i] = u

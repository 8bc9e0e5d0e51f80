"""The classical fourth-order Runge–Kutta step for q̈ = f(q, q̇), for mechanics that MuJoCo cannot
integrate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rk4(q: Array, v: Array, h: float, acceleration: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
    """Returns (q, q̇) after a step of h (s) from q (n,) and v (n,). `acceleration` computes q̈ (n,) from q
    and q̇.

    Stages and weights are those of MuJoCo's RK4, for joints with one degree of freedom.
    """
    slopes = [np.array((v, acceleration(q, v)))]
    for share in (0.5, 0.5, 1.0):
        q_stage, v_stage = (q, v) + share * h * slopes[-1]
        slopes.append(np.array((v_stage, acceleration(q_stage, v_stage))))
    first, second, third, fourth = slopes
    q_end, v_end = (q, v) + (h / 6.0) * (first + 2.0 * second + 2.0 * third + fourth)
    return q_end, v_end

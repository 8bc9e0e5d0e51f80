"""The incremental joint-space system (18)."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class JointState(NamedTuple):
    """Measured joint state: q, q̇ and q̈ (the backward difference of q̇), (n,) each."""

    q: Array
    v: Array
    a: Array

    def gained_velocity(self, N: int, T_s: float) -> Array:
        """Returns q̇ at knots 1 … N minus q̇_k, (N, n), for Δτ = 0. In this case (18) keeps q̈ constant."""
        return _steps(N, T_s) * self.a

    def free_position(self, N: int, T_s: float) -> Array:
        """Returns q at knots 1 … N for Δτ = 0, (N, n): explicit Euler, as printed."""
        return self.q + _euler(N, T_s) @ np.array((self.v, self.a))


@lru_cache(maxsize=64)
def _steps(N: int, T_s: float) -> Array:
    return np.asarray(T_s * np.arange(1.0, N + 1)[:, None], np.float64)


@lru_cache(maxsize=64)
def _euler(N: int, T_s: float) -> Array:
    """Returns the coefficients of q̇_k and q̈_k in q at knots 1 … N, (N, 2)."""
    steps = _steps(N, T_s)
    return np.hstack([steps, 0.5 * steps * (steps - T_s)])

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


@lru_cache(maxsize=64)
def _lags(N: int, T_s: float) -> Array:
    """Returns the coefficients of Δτ/M̄ at knot s in q at knot j+1, (N, N)."""
    lag = np.subtract.outer(np.arange(N), np.arange(N)).astype(float)
    return np.where(lag >= 0, T_s**2 * lag * (lag + 1) / 2, 0.0)


def predict_positions(state: JointState, U: Array, M_bar: Array, T_s: float) -> Array:
    """Returns q at knots 0 … N under the increments, (N+1, n), by (18).

    (17) is used with M̄⁻¹ (the paper prints it without the inverse): q̈_{j+1} = q̈_j + M̄⁻¹Δτ_j, q̇_{j+1} =
    q̇_j + T_s q̈_{j+1}, q_{j+1} = q_j + T_s q̇_j.

    Args:
        state: measured state.
        U: increments, (N, n) N·m.
        M_bar: diagonal of M̄, (n,).
        T_s: control period, s.
    """
    q = np.empty((len(U) + 1, state.q.size))
    q[0] = state.q
    moved = np.matmul(_lags(len(U), T_s), U / M_bar, out=q[1:])
    moved += state.free_position(len(U), T_s)
    return q

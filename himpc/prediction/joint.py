"""The incremental joint-space system (18)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class JointState:
    """Measured joint state: q, q̇ and q̈ (the backward difference of q̇), (n,) each."""

    q: Array
    v: Array
    a: Array

    def free_velocity(self, N: int, T_s: float) -> Array:
        """q̇ at knots 1 … N for Δτ = 0, (N, n): (18) then keeps q̈ constant."""
        return self.v + _steps(N, T_s) * self.a

    def free_position(self, N: int, T_s: float) -> Array:
        """q at knots 1 … N for Δτ = 0, (N, n): explicit Euler, as printed."""
        steps = _steps(N, T_s)
        return self.q + steps * self.v + 0.5 * steps * (steps - T_s) * self.a


@lru_cache(maxsize=64)
def _steps(N: int, T_s: float) -> Array:
    return np.asarray(T_s * np.arange(1.0, N + 1)[:, None], np.float64)


@lru_cache(maxsize=64)
def _lags(N: int, T_s: float) -> tuple[Array, Array]:
    """How Δτ/M̄ at knot s moves q̇ and q at knot j+1."""
    lag = np.subtract.outer(np.arange(N), np.arange(N)).astype(float)
    return np.where(lag >= 0, T_s * (lag + 1), 0.0), np.where(lag >= 0, T_s**2 * lag * (lag + 1) / 2, 0.0)


def predict_positions(state: JointState, U: Array, M_bar: Array, T_s: float) -> Array:
    """q at knots 0 … N under the increments, (N+1, n), by (18).

    (17) is read with M̄⁻¹ (printed without the inverse): q̈_{j+1} = q̈_j + M̄⁻¹Δτ_j, q̇_{j+1} = q̇_j + T_s q̈_{j+1},
    q_{j+1} = q_j + T_s q̇_j.

    Args:
        state: measured state.
        U: increments, (N, n) N·m.
        M_bar: diagonal of M̄, (n,).
        T_s: control period, s.
    """
    q = np.empty((len(U) + 1, state.q.size))
    q[0] = state.q
    q[1:] = state.free_position(len(U), T_s) + _lags(len(U), T_s)[1] @ (U / M_bar)
    return q


def predict_velocities(state: JointState, U: Array, M_bar: Array, T_s: float) -> Array:
    """q̇ at knots 0 … N under the increments, (N+1, n), by (18); arguments as in `predict_positions`."""
    v = np.empty((len(U) + 1, state.q.size))
    v[0] = state.v
    v[1:] = state.free_velocity(len(U), T_s) + _lags(len(U), T_s)[0] @ (U / M_bar)
    return v

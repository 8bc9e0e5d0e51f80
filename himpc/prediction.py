"""Prediction: the incremental systems over the horizon. The task-space system (15) gives the effect of
increments and of the free motion on the residual (28), the joint-space system (18) the joints' motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from robots.arrays import Array


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


@dataclass(frozen=True, slots=True, eq=False)
class ResidualModel:
    """The model e_{j+1} = free_{j+1} + Σ_s C[j, ·, s] ∘ (J_s M̄⁻¹ Δτ_s) for one set of gains, horizon and
    period.

    The double integrator (14) makes the effect of Δτ_s on e_{j+1} a scalar per coordinate,
    c_l = 1 + K_v T_s (l+1) + K_p T_s² l(l+1)/2 with l = j − s: no powers of A₁ are needed.

    Attributes:
        C: (N, m, N), zero above the diagonal.
        on_velocity, on_acceleration: (N, m) weights of ẋ_k and ẍ_k in the free residual.
        K_p, K_v: (m,).
    """

    C: Array
    on_velocity: Array
    on_acceleration: Array
    K_p: Array
    K_v: Array

    def free(
        self,
        error: Array,
        velocity: Array,
        acceleration: Array,
        displacement_d: Array,
        velocity_d: Array,
        acceleration_d: Array,
    ) -> Array:
        """Returns e at knots 1 … N for Δτ = 0, (N, m).

        Args:
            error: x̃_k, (m,).
            velocity: ẋ_k, (m,).
            acceleration: ẍ_k, (m,).
            displacement_d: x_d(k+j) ⊖ x_d(k), j = 1 … N, (N, m).
            velocity_d, acceleration_d: ẋ_d and ẍ_d at k+1 … k+N, (N, m).
        """
        moving = self.K_p * error + self.on_velocity * velocity + self.on_acceleration * acceleration
        return moving - (acceleration_d + self.K_v * velocity_d + self.K_p * displacement_d)


def residual_model(K_p: Array, K_v: Array, N: int, T_s: float) -> ResidualModel:
    """Returns the coefficients for gains K_p, K_v (m,), N knots and period T_s (s)."""
    lag = np.subtract.outer(np.arange(N), np.arange(N))[:, None, :].astype(float)
    kp, kv = K_p[None, :, None], K_v[None, :, None]
    C = 1.0 + kv * T_s * (lag + 1.0) + kp * T_s**2 * lag * (lag + 1.0) / 2.0
    j = np.arange(N)[:, None].astype(float)
    return ResidualModel(
        C=np.where(lag >= 0, C, 0.0),
        on_velocity=K_v + K_p * T_s * (j + 1.0),
        on_acceleration=1.0 + K_v * T_s * (j + 1.0) + K_p * T_s**2 * j * (j + 1.0) / 2.0,
        K_p=K_p,
        K_v=K_v,
    )

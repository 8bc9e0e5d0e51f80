"""The incremental task-space system (15): the effect of increments and of the free motion on the residual
(28)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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

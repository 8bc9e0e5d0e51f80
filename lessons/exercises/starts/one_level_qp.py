"""Exercise one-level-qp: one level of the QP (35), one knot, with its bounds.

    himpc-lab grade FILE.py
    himpc-lab --scene planar3-circle --controller FILE.py

min ‖e⁰ + G Δτ‖²_Q + ‖Δτ‖²_R, the torque τ₀ + Δτ and the next velocity within their bounds.
"""

import numpy as np

from himpc.qp import solve_qp

EXERCISE = "one-level-qp"


def torque(now):
    level = now.levels[0]
    # TODO: e⁰ (m,) and G (m, n) of the residual (28) at the next knot:
    # ẍ − ẍ_d + K_v (ẋ − ẋ_d) + K_p x̃ with ẍ = ẍ₀ + J M̄⁻¹ Δτ, ẋ = ẋ₀ + T_s ẍ, x̃ = x̃₀ + T_s ẋ₀ − (step of x_d).
    G = level.J / now.M_bar
    e = level.x_ddot + level.K_v * level.x_dot + level.K_p * level.error
    H = G.T @ (level.Q[:, None] * G) + np.diag(level.R)
    f = G.T @ (level.Q * e)
    # TODO: the bounds on τ₀ + Δτ, and rows for the next velocity.
    lower, upper = np.full(now.n, -np.inf), np.full(now.n, np.inf)
    return now.tau_0 + solve_qp(H, f, np.eye(now.n), lower, upper).x

"""Exercise two-levels: two levels with the equality (33).

    himpc-lab grade FILE.py
    himpc-lab --scene planar3-conflict --controller FILE.py

Level 2: the same QP as level 1, and J₁ M̄⁻¹ Δτ₂ = J₁ M̄⁻¹ Δτ₁.
"""

import numpy as np

from himpc.qp import solve_qp

EXERCISE = "two-levels"


def torque(now):
    torques = []
    for level in now.levels:
        H, f = quadratic(now, level)
        rows, lower, upper = bounds(now)
        # TODO: for the second level the rows J₁ M̄⁻¹ with lower = upper = J₁ M̄⁻¹ Δτ₁.
        torques.append(now.tau_0 + solve_qp(H, f, rows, lower, upper).x)
    return torques  # one row per level: the last row acts


def quadratic(now, level):
    """Returns H and f of ½ΔτᵀHΔτ + fᵀΔτ for ‖e⁰ + G Δτ‖²_Q + ‖Δτ‖²_R, as in exercise one-level-qp."""
    T = now.T_s
    G = (1.0 + level.K_v * T)[:, None] * level.J / now.M_bar
    e = (
        level.x_ddot
        - level.x_ddot_d[1]
        + level.K_v * (level.x_dot + T * level.x_ddot - level.x_dot_d[1])
        + level.K_p * (level.error + T * level.x_dot - level.displacement_d[1])
    )
    return G.T @ (level.Q[:, None] * G) + np.diag(level.R), G.T @ (level.Q * e)


def bounds(now):
    """Returns rows, lower and upper of lower ≤ rows Δτ ≤ upper: the bounds of the torque, and the bounds of
    the next velocity, multiplied by M̄/T_s."""
    T, limit, share = now.T_s, now.bounds, min(1.0, now.bounds.approach * now.T_s or 1.0)
    scale = now.M_bar / T
    lower = [limit.tau_lower - now.tau_0, (share * (limit.v_lower - now.q_dot) - T * now.q_ddot) * scale]
    upper = [limit.tau_upper - now.tau_0, (share * (limit.v_upper - now.q_dot) - T * now.q_ddot) * scale]
    return np.vstack([np.eye(now.n), np.eye(now.n)]), np.concatenate(lower), np.concatenate(upper)

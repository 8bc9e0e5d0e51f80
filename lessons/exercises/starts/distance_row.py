"""Exercise distance-row: rows that keep distances, above all levels.

    himpc-lab grade FILE.py
    himpc-lab --scene iiwa14-table --controller FILE.py    # then set "Keep distances"

For each of the nearest pairs, ∇dᵀ q̇ at the next knot must be at least −v_stop(d − d_safe).
v_stop(s) = a (√(t² + 2s/a) − t) is the speed from which the pair can stop within s.
"""

import numpy as np

from himpc.qp import solve_qp

EXERCISE = "distance-row"


def distance_rows(now):
    """Returns the rows D (r, n) and their lower bounds (r,): D Δτ ≥ lower, one row for each pair."""
    # `now.near` has d and d_safe (r,), gradient (r, n), reaction (t in s) and deceleration (a in m/s²).
    # TODO: the next velocity is q̇ + T_s (q̈₀ + M̄⁻¹ Δτ). Which D and which lower bound follow from this?
    return np.zeros((0, now.n)), np.zeros(0)


def torque(now):
    D, lower = distance_rows(now)
    return cascade(now, D, lower)


# ------------------------------------------------------------ the levels, as in exercise two-levels: complete


def cascade(now, D, least):
    """Returns the torques of the levels under all bounds, including D Δτ ≥ least."""
    torques, step = [], np.zeros(now.n)
    for level in now.levels:
        H, f = quadratic(now, level)
        rows, lower, upper = bounds(now)
        rows, lower = np.vstack([rows, D]), np.r_[lower, least]
        upper = np.r_[upper, np.full(len(D), np.inf)]
        if torques:
            lower, upper = np.minimum(lower, rows @ step), np.maximum(upper, rows @ step)
        for above in now.levels[: len(torques)]:
            B = above.J / now.M_bar
            rows, lower, upper = np.vstack([rows, B]), np.r_[lower, B @ step], np.r_[upper, B @ step]
        solution = solve_qp(H, f, rows, lower, upper)
        if not solution.solved:  # no torque meets all rows: brake the joints
            return now.tau_0 - now.M_bar * (now.q_ddot + 5.0 * now.q_dot)
        step = solution.x
        torques.append(now.tau_0 + step)
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

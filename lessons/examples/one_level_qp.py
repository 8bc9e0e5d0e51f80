"""One level, one knot: all tasks in one quadratic program on the increment Δτ, within the bounds.

    himpc-lab run planar3-circle --controller FILE.py

min Σ ‖e‖²_Q + ‖Δτ‖²_R with e the residual (28) at the next knot. The residual is affine in Δτ: the last
torque and the acceleration that it caused replace a model of the robot (time-delay estimation, (9) of the
HIMPC paper).
"""

import numpy as np

from himpc.qp import solve_qp


def torque(now):
    T = now.T_s
    H, f = np.zeros((now.n, now.n)), np.zeros(now.n)
    for level in now.levels:
        # e = e⁰ + G Δτ: one more period with the present acceleration, changed by J M̄⁻¹ Δτ.
        G = (1.0 + level.K_v * T)[:, None] * level.J / now.M_bar
        e = (
            level.x_ddot
            - level.x_ddot_d[1]
            + level.K_v * (level.x_dot + T * level.x_ddot - level.x_dot_d[1])
            + level.K_p * (level.error + T * level.x_dot - level.displacement_d[1])
        )
        H += G.T @ (level.Q[:, None] * G) + np.diag(level.R)
        f += G.T @ (level.Q * e)
    # The next velocity, q̇ + T_s (q̈ + M̄⁻¹ Δτ), may use only a share of the distance to its bound.
    share = min(1.0, now.bounds.approach * T or 1.0)
    free = now.M_bar / T * (-T * now.q_ddot)
    v_lower = share * (now.bounds.v_lower - now.q_dot) * now.M_bar / T + free
    v_upper = share * (now.bounds.v_upper - now.q_dot) * now.M_bar / T + free
    rows = np.vstack([np.eye(now.n), np.eye(now.n)])
    lower = np.concatenate([now.bounds.tau_lower - now.tau_0, v_lower])
    upper = np.concatenate([now.bounds.tau_upper - now.tau_0, v_upper])
    return now.tau_0 + solve_qp(H, f, rows, lower, upper).x

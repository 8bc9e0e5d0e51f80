"""OSF: operational-space control with null-space projection on the nominal model, [9] of the HIMPC paper.

    himpc-lab run planar3-circle --controller FILE.py

Level by level, with J the Jacobian, N the projector of the levels above and Λ the inertia of the task:
τ = C q̇ + g + Σ (J N)ᵀ Λ (ẍ − J̇ q̇ − J M⁻¹ τ_above). The function returns one row of torques per level, so
that the lab can measure how much a level accelerates the levels above (the leak).
"""

import numpy as np


def torque(now):
    M_inv = np.linalg.inv(now.M)
    N = np.eye(now.n)  # projector on the accelerations that the levels above leave free
    tau = np.zeros(now.n)
    torques = []
    for level in now.levels:
        # The target motion (4): ẍ_d − K_v (ẋ − ẋ_d) − K_p x̃.
        wanted = level.x_ddot_d[0] - level.K_v * (level.x_dot - level.x_dot_d[0]) - level.K_p * level.error
        J = level.J @ N
        # In directions without freedom there is no inverse; in these the pseudo-inverse is zero.
        Lambda = np.linalg.pinv(J @ M_inv @ J.T, rcond=1e-9, hermitian=True)
        tau = tau + J.T @ Lambda @ (wanted - level.J_dot_q_dot - level.J @ M_inv @ tau)
        N = N - M_inv @ J.T @ Lambda @ J
        torques.append(now.bias + tau)
    return torques or now.bias

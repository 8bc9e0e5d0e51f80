"""Exercise null-space: a second task that does not disturb the first (OSF).

himpc-lab grade FILE.py
himpc-lab --scene planar3-circle --controller FILE.py
"""

import numpy as np

EXERCISE = "null-space"


def torque(now):
    M_inv = np.linalg.inv(now.M)
    tau = np.zeros(now.n)
    torques = []
    for level in now.levels:
        J = level.J
        wanted = (
            level.x_ddot_d[0]
            - level.K_v * (level.x_dot - level.x_dot_d[0])
            - level.K_p * level.error
            - level.J_dot_q_dot
        )
        # Both levels may ask for more than the joints can do: then J M⁻¹ Jᵀ is singular, and pinv is needed.
        Lambda = np.linalg.pinv(J @ M_inv @ J.T, rcond=1e-9, hermitian=True)
        # TODO: project J on the freedom that the levels above leave, and subtract their effect on ẍ.
        tau = tau + J.T @ Lambda @ wanted
        torques.append(now.bias + tau)
    return torques  # one row per level: the last row acts

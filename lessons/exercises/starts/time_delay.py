"""Exercise time-delay: hold an unknown load without a model.

    himpc-lab grade FILE.py
    himpc-lab --scene iiwa14-hold --controller FILE.py

τ = M̄ q̈_wanted + Ĥ. The last tick gives Ĥ: τ₀ = M̄ q̈₀ + Ĥ.
"""

EXERCISE = "time-delay"


def torque(now):
    posture = now.level("posture")
    wanted = (
        posture.x_ddot_d[0] - posture.K_v * (posture.x_dot - posture.x_dot_d[0]) - posture.K_p * posture.error
    )
    # TODO: Ĥ from now.tau_0 (τ₀) and now.q_ddot (q̈₀).
    H = now.gravity
    return now.M_bar * wanted + H

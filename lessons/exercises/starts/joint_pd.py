"""Exercise joint-pd: PD control with gravity compensation.

    himpc-lab grade FILE.py
    himpc-lab --scene planar3-hold --controller FILE.py

τ = g(q) + M̄ (q̈_d − K_v (q̇ − q̇_d) − K_p (q − q_d))
"""

EXERCISE = "joint-pd"


def torque(now):
    posture = now.level("posture")
    error = posture.error  # q − q_d, (n,)
    velocity = posture.x_dot - posture.x_dot_d[0]  # q̇ − q̇_d
    # TODO: the acceleration that brings the error to zero, with posture.K_p and posture.K_v.
    acceleration = 0.0 * error - 0.0 * velocity
    # TODO: gravity is in now.gravity.
    return now.M_bar * acceleration

"""PD with gravity compensation: every level controls its own coordinates, and nothing decouples the levels.

    himpc-lab run planar3-hold --controller FILE.py

`torque(now)` is called once per control period with all measurements and references, and returns a
torque per joint, (n,) N·m. `himpc.controllers.view.View` lists the attributes of `now`.
"""


def torque(now):
    tau = now.gravity.copy()
    for level in now.levels:
        # The acceleration of the target motion (4) of the HIMPC paper.
        acceleration = (
            level.x_ddot_d[0] - level.K_v * (level.x_dot - level.x_dot_d[0]) - level.K_p * level.error
        )
        tau += now.M_bar * (level.J.T @ acceleration)
    return tau

"""Correct solutions of the exercises, each in three styles of programming."""

from __future__ import annotations

from lessons.exercises import start_of

TASK = """
def wanted(level):
    return (level.x_ddot_d[0] - level.K_v * (level.x_dot - level.x_dot_d[0]) - level.K_p * level.error)
"""
PD = (
    TASK
    + """
def torque(now):
    return now.gravity + now.M_bar * wanted(now.level("posture"))
"""
)
OSF = (
    TASK
    + """
import numpy as np

def torque(now):
    M_inv = np.linalg.inv(now.M)
    N, tau, torques = np.eye(now.n), np.zeros(now.n), []
    for level in now.levels:
        J = level.J @ N
        L = np.linalg.pinv(J @ M_inv @ J.T, rcond=1e-9, hermitian=True)
        tau = tau + J.T @ L @ (wanted(level) - level.J_dot_q_dot - level.J @ M_inv @ tau)
        N = N - M_inv @ J.T @ L @ J
        torques.append(now.bias + tau)
    return torques
"""
)
TDE = (
    TASK
    + """
def torque(now):
    return now.tau_0 + now.M_bar * (wanted(now.level("posture")) - now.q_ddot)
"""
)
_HOLE = "        # TODO: for the second level the rows J₁ M̄⁻¹ with lower = upper = J₁ M̄⁻¹ Δτ₁.\n"
QP = (
    start_of("two-levels")
    .replace('EXERCISE = "two-levels"', "")
    .replace(
        _HOLE,
        "        if torques:\n"
        "            B, U = now.levels[0].J / now.M_bar, torques[0] - now.tau_0\n"
        "            rows = np.vstack([rows, B])\n"
        "            lower = np.r_[np.minimum(lower, rows[:-len(B)] @ U), B @ U]\n"
        "            upper = np.r_[np.maximum(upper, rows[:-len(B)] @ U), B @ U]\n",
    )
)
ONE = QP.replace("in now.levels:", "in now.levels[:1]:")
_ROWS = start_of("distance-row").replace('EXERCISE = "distance-row"', "")
_NO_ROWS = "    return np.zeros((0, now.n)), np.zeros(0)\n"
DISTANCE = _ROWS.replace(
    _NO_ROWS,
    """
    near, T, t, a = now.near, now.T_s, now.near.reaction, now.near.deceleration
    slopes, distance, speed = near.gradient, near.d, near.gradient @ now.q_dot
    room = np.maximum(distance - near.d_safe, 0.0)
    v_stop = a * (np.sqrt(t**2 + 2.0 * room / a) - t)
    share = min(1.0, now.bounds.approach * T or 1.0)
    D = T * slopes / now.M_bar
    return D, share * (-v_stop - speed) - T * slopes @ now.q_ddot
""",
)
RIGHT = {
    "joint-pd": PD,
    "null-space": OSF,
    "time-delay": TDE,
    "one-level-qp": ONE,
    "two-levels": QP,
    "distance-row": DISTANCE,
}

# The following solutions are the same laws in other styles of programming.
_PD_CLASS = """
class Controller:
    def torque(self, now):
        posture = now.level("posture")
        q_d_dot, q_d_ddot = posture.x_dot_d[0], posture.x_ddot_d[0]
        spring = -posture.K_p * posture.error
        damper = posture.K_v * (q_d_dot - now.q_dot)
        print("torque")
        return (q_d_ddot + spring + damper) * now.M_bar + now.gravity
"""
_OSF_ONE_BY_ONE = """
import numpy as np

def torque(now):
    one, two = now.levels
    first = one.J.T @ force(now, one, one.J, 0 * now.q)
    J_1_bar = np.linalg.solve(now.M, one.J.T) @ inertia(now, one.J)
    J_2 = two.J @ (np.eye(now.n) - J_1_bar @ one.J)
    second = first + J_2.T @ force(now, two, J_2, first)
    return np.array([first, second]) + now.bias

def inertia(now, J):
    return np.linalg.pinv(J @ np.linalg.solve(now.M, J.T), rcond=1e-9, hermitian=True)

def force(now, level, J, tau):
    wish = level.x_ddot_d[0] + level.K_v * (level.x_dot_d[0] - level.x_dot) - level.K_p * level.error
    return inertia(now, J) @ (wish - level.J_dot_q_dot - level.J @ np.linalg.solve(now.M, tau))
"""
_TDE_ESTIMATE = """
def torque(now):
    level, H = now.levels[0], now.tau_0 - now.M_bar * now.q_ddot
    e, e_dot = level.error, level.x_dot - level.x_dot_d[0]
    return now.M_bar * (level.x_ddot_d[0] - level.K_v * e_dot - level.K_p * e) + H
"""
_QP_OF_TORQUES = QP.replace("levels:\n        H,", "levels[:1]:\n        H,").replace(
    "torques.append(now.tau_0 + solve_qp(H, f, rows, lower, upper).x)",
    "at = rows @ now.tau_0\n"
    "        torques.append(solve_qp(H, f - H @ now.tau_0, rows, lower + at, upper + at).x)",
)
_TWO_BY_BASIS = (
    start_of("two-levels")
    .replace('EXERCISE = "two-levels"', "")
    .replace(
        _HOLE,
        "        if torques:\n"
        "            first = torques[0] - now.tau_0\n"
        "            B = now.levels[0].J / now.M_bar\n"
        "            Z = np.linalg.svd(B)[2][len(B):].T\n"
        "            lower, upper = lower - rows @ first, upper - rows @ first\n"
        "            y = solve_qp(Z.T @ H @ Z, Z.T @ (f + H @ first), rows @ Z,\n"
        "                         np.minimum(lower, 0), np.maximum(upper, 0)).x\n"
        "            torques.append(torques[0] + Z @ y)\n"
        "            continue\n",
    )
)


_PD_LOOP = """
def torque(now):
    found = []
    for joint in range(now.n):
        each = now.levels[0]
        a = each.x_ddot_d[0][joint]
        a += each.K_v[joint] * (each.x_dot_d[0][joint] - each.x_dot[joint])
        a -= each.K_p[joint] * each.error[joint]
        found.append(float(now.gravity[joint] + now.M_bar[joint] * a))
    return found
"""
_OSF_CLASS = """
import numpy as np
from scipy.linalg import cho_factor, cho_solve

class Controller:
    def torque(self, now):
        M = cho_factor(now.M)
        q_ddot, N, rows = cho_solve(M, -now.bias * 0.0), np.eye(now.n), []
        for level in now.levels:
            want = level.x_ddot_d[0] - level.K_v * (level.x_dot - level.x_dot_d[0])
            want = want - level.K_p * level.error - level.J_dot_q_dot
            J = level.J @ N
            B = cho_solve(M, J.T)
            step = B @ np.linalg.pinv(J @ B, rcond=1e-9, hermitian=True)
            q_ddot = q_ddot + step @ (want - level.J @ q_ddot)
            N = N - step @ J
            rows.append(now.M @ q_ddot + now.bias)
        return np.vstack(rows)
"""
_OSF_KKT = (
    TASK
    + """
import numpy as np

def torque(now):
    one, two = now.levels
    force = np.linalg.pinv(one.J @ np.linalg.solve(now.M, one.J.T)) @ (wanted(one) - one.J_dot_q_dot)
    first = now.bias + one.J.T @ force
    # The least error of level 2 among the accelerations that level 1 permits.
    K = np.block([[two.J.T @ two.J, one.J.T], [one.J, np.zeros((len(one.J),) * 2)]])
    asked = np.r_[two.J.T @ (wanted(two) - two.J_dot_q_dot), wanted(one) - one.J_dot_q_dot]
    q_ddot = np.linalg.lstsq(K, asked, rcond=None)[0][: now.n]
    return [first, now.bias + now.M @ q_ddot]
"""
)
_TDE_CLASS = """
import numpy as np

class Controller:
    def torque(self, now):
        asked = np.zeros(now.n)
        for level in [now.level("posture")]:
            asked += level.x_ddot_d[0]
            asked += level.K_v * (level.x_dot_d[0] - level.x_dot)
            asked -= level.K_p * level.error
        return np.diag(now.M_bar) @ (asked - now.q_ddot) + np.array(now.tau_0)
"""
_ONE_OF_ACCELERATIONS = ONE.replace(
    "torques.append(now.tau_0 + solve_qp(H, f, rows, lower, upper).x)",
    "W = np.diag(now.M_bar)\n"
    "        u = solve_qp(W @ H @ W, W @ f, rows @ W, lower, upper).x\n"
    "        return now.tau_0 + now.M_bar * u",
)
_TWO_BY_ELIMINATION = (
    start_of("two-levels")
    .replace('EXERCISE = "two-levels"', "")
    .replace(
        _HOLE,
        "        if torques:\n"
        "            first = torques[0] - now.tau_0\n"
        "            B = now.levels[0].J / now.M_bar\n"
        "            P = np.eye(now.n) - np.linalg.pinv(B) @ B\n"
        "            H_free, f_free = P @ H @ P + 1e-12 * np.eye(now.n), P @ (f + H @ first)\n"
        "            lower, upper = lower - rows @ first, upper - rows @ first\n"
        "            y = solve_qp(H_free, f_free, rows @ P, np.minimum(lower, 0), np.maximum(upper, 0)).x\n"
        "            torques.append(torques[0] + P @ y)\n"
        "            continue\n",
    )
)
_DISTANCE_LOOP = _ROWS.replace(
    _NO_ROWS,
    """
    rows, lower = [], []
    for d, d_safe, slope in zip(now.near.d, now.near.d_safe, now.near.gradient):
        a, t = now.near.deceleration, now.near.reaction
        fastest = a * ((t * t + 2 * max(d - d_safe, 0) / a) ** 0.5 - t)
        left = -fastest - slope.dot(now.q_dot)
        allowed = left * min(1, now.bounds.approach * now.T_s) / now.T_s
        # N·m, a direction of length one
        along = slope / now.M_bar
        length = np.linalg.norm(along)
        rows.append(along / length)
        lower.append((allowed - slope.dot(now.q_ddot)) / length)
    return np.array(rows).reshape(-1, now.n), np.array(lower)
""",
)
_DISTANCE_CLASS = (
    _ROWS.replace("def torque(now):", "def _torque(now):")
    + """

class Controller:
    \"\"\"Rows of the next velocity, which are turned into rows of the increment.\"\"\"

    def torque(self, now):
        A, least = self.velocity_rows(now)
        coasting = now.q_dot + now.T_s * now.q_ddot
        return cascade(now, A @ np.diag(now.T_s / now.M_bar), least - A @ coasting)

    def velocity_rows(self, now):
        near, share = now.near, now.T_s * now.bounds.approach
        a, t = near.deceleration, near.reaction
        room = np.where(near.d > near.d_safe, near.d - near.d_safe, 0.0)
        stop = 2.0 * room / (np.sqrt(t**2 + 2.0 * room / a) + t)
        now_growing = near.gradient @ now.q_dot
        return near.gradient, now_growing - share * (stop + now_growing)
"""
)
STYLES: dict[str, tuple[str, ...]] = {
    "joint-pd": (PD, _PD_CLASS, _PD_LOOP),
    "null-space": (OSF, _OSF_ONE_BY_ONE, _OSF_CLASS, _OSF_KKT),
    "time-delay": (TDE, _TDE_ESTIMATE, _TDE_CLASS),
    "one-level-qp": (ONE, _QP_OF_TORQUES, _ONE_OF_ACCELERATIONS),
    "two-levels": (QP, _TWO_BY_BASIS, _TWO_BY_ELIMINATION),
    "distance-row": (DISTANCE, _DISTANCE_LOOP, _DISTANCE_CLASS),
}
"""Correct solutions in three styles each."""

"""Thirty submissions, as students hand them in: ten are right, twenty are wrong, each differently."""

from __future__ import annotations

from dataclasses import dataclass

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
RIGHT = {"joint-pd": PD, "null-space": OSF, "time-delay": TDE, "one-level-qp": QP, "two-levels": QP}

# The same laws as somebody else writes them.
_PD_CLASS = """
class Controller:
    def torque(self, now):
        posture = now.level("posture")
        q_d_dot, q_d_ddot = posture.x_dot_d[0], posture.x_ddot_d[0]
        spring = -posture.K_p * posture.error
        damper = posture.K_v * (q_d_dot - now.q_dot)
        print("torque", now.gravity)
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


@dataclass(frozen=True)
class Submission:
    """A file, the points it deserves, and words of what is to be said about it."""

    exercise: str
    text: str
    points: int
    words: str = ""

    @property
    def file(self) -> str:
        return f'EXERCISE = "{self.exercise}"\n{self.text}'


def _wrong(exercise: str, good: str, bad: str, points: int, words: str) -> Submission:
    assert good in RIGHT[exercise], good
    return Submission(exercise, RIGHT[exercise].replace(good, bad), points, words)


def _bad(line: str, points: int, words: str) -> Submission:
    """A joint PD that is none, and does something else."""
    return Submission("joint-pd", f"def torque(now):\n    {line}\n    return now.gravity\n", points, words)


_LOG = ", ".join(f"[{0.02 * k:g}, {-0.01 * k:g}, {0.005 * k:g}]" for k in range(40))

SUBMISSIONS: dict[str, Submission] = {
    **{f"right_{name.replace('-', '_')}": Submission(name, text, 10) for name, text in RIGHT.items()},
    "right_pd_class": Submission("joint-pd", _PD_CLASS, 10),
    "right_osf_one_by_one": Submission("null-space", _OSF_ONE_BY_ONE, 10),
    "right_tde_estimate": Submission("time-delay", _TDE_ESTIMATE, 10),
    "right_qp_of_torques": Submission("one-level-qp", _QP_OF_TORQUES, 10),
    "right_two_by_basis": Submission("two-levels", _TWO_BY_BASIS, 10),
    "wrong_sign": _wrong("joint-pd", "- level.K_p", "+ level.K_p", 2, "comes back"),
    "wrong_no_curvature": _wrong("null-space", "- level.J_dot_q_dot", "", 7, "J̇q̇, the order"),
    "wrong_no_projection": _wrong("null-space", "level.J @ N", "level.J", 2, "reaches the hand"),
    "wrong_weighted": _wrong("two-levels", "if torques:", "if False:", 0, "a weighted sum is not strict"),
    "wrong_no_bound": _wrong(
        "two-levels",
        "= bounds(now)",
        "= bounds(now)\n        lower, upper = lower - 1e3, upper + 1e3",
        5,
        "bounds must stand in the QP of both levels",
    ),
    "wrong_cut_off": _wrong(
        "one-level-qp",
        "solve_qp(H, f, rows, lower, upper).x",
        "np.clip(np.linalg.solve(H, -f), lower[: now.n], upper[: now.n])",
        6,
        "cutting the torque afterwards is not the same",
    ),
    "wrong_constant": Submission("time-delay", "def torque(now):\n    return [0.1] * now.n\n", 0, "sag"),
    "wrong_copied_log": Submission(
        "joint-pd",
        f"LOG = [{_LOG}]\n\nclass Controller:\n    tick = -1\n\n    def torque(self, now):\n"
        "        self.tick += 1\n        return (LOG[self.tick % len(LOG)] * 3)[: now.n]\n",
        0,
        "A new posture",
    ),
    "wrong_sleeps": _bad("import time; time.sleep(0.7)", 0, "takes longer than 0.5 s"),
    "wrong_exits": _bad("raise SystemExit", 0, "it ends the program"),
    "wrong_leaves": _bad("import os; os._exit(0)", 0, "was ended by the program itself"),
    "wrong_prints": _bad("print('x' * 10**5)", 2, "comes back"),
    "wrong_opens": _bad("open('/etc/hostname').read()", 0, "may not do that (open /etc/hostname)"),
    "wrong_kills": _bad("import os; os.kill(os.getppid(), 9)", 0, "may not do that (os.kill)"),
    "wrong_memory": _bad("held = [bytes(10**9) for _ in range(10**4)]", 0, "memory"),
    "wrong_nan": _bad("return now.q * float('nan')", 0, "finite"),
    "wrong_shape": _bad("return now.q[:2]", 0, "shape (2,)"),
    "wrong_syntax": Submission(
        "joint-pd", "def torque(now)\n    return now.gravity\n", 0, "line 2: expected ':'"
    ),
    "wrong_name": _bad("gravity(now)", 0, "line 3: NameError"),
    "wrong_endless": _bad("while True: pass", 0, "takes longer than 0.5 s"),
}
"""By the name of the file, without its suffix."""

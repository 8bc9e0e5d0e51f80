"""Submissions as students hand them in: fifteen right ones, known mistakes, and what misbehaves."""

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
ONE = QP.replace("in now.levels:", "in now.levels[:1]:")
RIGHT = {"joint-pd": PD, "null-space": OSF, "time-delay": TDE, "one-level-qp": ONE, "two-levels": QP}

# The same laws as somebody else writes them.
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
STYLES: dict[str, tuple[str, ...]] = {
    "joint-pd": (PD, _PD_CLASS, _PD_LOOP),
    "null-space": (OSF, _OSF_ONE_BY_ONE, _OSF_CLASS),
    "time-delay": (TDE, _TDE_ESTIMATE, _TDE_CLASS),
    "one-level-qp": (ONE, _QP_OF_TORQUES, _ONE_OF_ACCELERATIONS),
    "two-levels": (QP, _TWO_BY_BASIS, _TWO_BY_ELIMINATION),
}
"""Right solutions in three styles each."""


@dataclass(frozen=True)
class Mistake:
    """What is changed in a right solution, the marks it deserves, and words of what is to be said of it.

    Attributes:
        good, bad: the lines that are there and that stand there instead; good "" for another text altogether.
        most: points it may get.
        words: that name the mistake.
    """

    good: str
    bad: str
    most: int
    words: str

    def text(self, exercise: str) -> str:
        """The submission."""
        if not self.good:
            return self.bad
        assert self.good in RIGHT[exercise], self.good
        return RIGHT[exercise].replace(self.good, self.bad)


_HELD = "def torque(now):\n    return now.tau_0\n"
_FROZEN = (
    TASK
    + """
class Controller:
    gravity = None

    def torque(self, now):
        if self.gravity is None:
            self.gravity = now.gravity
        return self.gravity + now.M_bar * wanted(now.level("posture"))
"""
)
MISTAKES: dict[str, dict[str, Mistake]] = {
    "joint-pd": {
        "sign of K_p": Mistake("- level.K_p", "+ level.K_p", 2, "K_p has the wrong sign"),
        "no K_p": Mistake("level.K_p *", "0.0 *", 7, "K_p is missing"),
        "sign of K_v": Mistake("- level.K_v", "+ level.K_v", 2, "K_v has the wrong sign"),
        "no K_v": Mistake("level.K_v *", "0.0 *", 5, "K_v is missing"),
        "no gravity": Mistake("now.gravity +", "", 5, "g(q) is missing"),
        "sign of gravity": Mistake("now.gravity +", "-now.gravity +", 5, "g(q) has the wrong sign"),
        "gravity of the start": Mistake("", _FROZEN, 7, "g(q) is that of the start"),
        "no M̄": Mistake("now.M_bar *", "", 5, "M̄ is missing"),
        "no target": Mistake("level.error", 'level.x["posture"]', 5, "q_d is missing"),
        "holds the torque": Mistake("", _HELD, 2, "the torque is held"),
    },
    "null-space": {
        "no J̇q̇": Mistake("- level.J_dot_q_dot", "", 7, "J̇q̇ is missing"),
        "sign of J̇q̇": Mistake("- level.J_dot_q_dot", "+ level.J_dot_q_dot", 7, "J̇q̇ has the wrong sign"),
        "no projection": Mistake("level.J @ N", "level.J", 4, "the projector is missing"),
        "transposed projector": Mistake(
            "M_inv @ J.T @ L @ J", "J.T @ L @ J @ M_inv", 6, "the order of its products"
        ),
        "not consistent": Mistake(
            "M_inv @ J.T @ L @ J", "np.linalg.pinv(J) @ J", 6, "not dynamically consistent"
        ),
        "asks twice": Mistake("- level.J @ M_inv @ tau", "", 7, "asked for twice"),
        "reverse order": Mistake(
            "in now.levels:", "in now.levels[::-1]:", 3, "the levels are in reverse order"
        ),
        "only one level": Mistake("in now.levels:", "in now.levels[:1]:", 4, "the second level is left out"),
        "no bias": Mistake("now.bias +", "", 7, "C q̇ + g is missing"),
        "sign of K_p": Mistake("- level.K_p", "+ level.K_p", 3, "K_p has the wrong sign"),
        "sign of K_v": Mistake("- level.K_v", "+ level.K_v", 3, "K_v has the wrong sign"),
    },
    "time-delay": {
        "holds the torque": Mistake("", _HELD, 1, "the torque is held"),
        "sign of q̈₀": Mistake("- now.q_ddot", "+ now.q_ddot", 3, "q̈₀ has the wrong sign"),
        "no q̈₀": Mistake("- now.q_ddot", "", 3, "q̈₀ is missing"),
        "q̈₀ without T_s": Mistake("- now.q_ddot", "- now.T_s * now.q_ddot", 3, "not divided by T_s"),
        "the model instead": Mistake("now.tau_0 +", "now.gravity +", 3, "the model stands where τ₀ belongs"),
        "Ĥ from the model": Mistake("", PD, 3, "the model stands where Ĥ belongs"),
        "gravity as well": Mistake("now.tau_0 +", "now.tau_0 + now.gravity +", 2, "g(q) is in τ₀ already"),
        "no M̄": Mistake("now.M_bar *", "", 3, "M̄ is missing"),
        "sign of K_p": Mistake("- level.K_p", "+ level.K_p", 3, "K_p has the wrong sign"),
        "no K_v": Mistake("level.K_v *", "0.0 *", 5, "K_v is missing"),
        "no τ₀": Mistake("now.tau_0 +", "", 2, "τ₀ is missing"),
    },
    "one-level-qp": {
        "no bounds": Mistake(
            "solve_qp(H, f, rows, lower, upper)",
            "solve_qp(H, f, rows, lower - 1e5, upper + 1e5)",
            5,
            "no bound is in the QP",
        ),
        "bound afterwards": Mistake(
            "solve_qp(H, f, rows, lower, upper).x",
            "np.clip(np.linalg.solve(H, -f), lower[: now.n], upper[: now.n])",
            7,
            "clipped after the QP",
        ),
        "no velocity bound": Mistake("- now.q_dot)", ") * 1e6", 8, "the velocity bound (32e) is missing"),
        "bound on Δτ": Mistake("- now.tau_0, (share", ", (share", 7, "is imposed on Δτ"),
        "approached at once": Mistake("min(1.0, now.bounds.approach * now.T_s or 1.0)", "1.0", 8, "at once"),
        "sign of f": Mistake("G.T @ (level.Q * e)", "-G.T @ (level.Q * e)", 2, "f has the wrong sign"),
        "no R": Mistake("np.diag(level.R)", "1e-9 * np.eye(now.n)", 9, "R is missing"),
        "no Q": Mistake("level.Q * e", "e", 5, "Q is missing in f"),
        "references of now": Mistake("_d[1]", "_d[0]", 6, "this tick's"),
        "no M̄": Mistake("level.J / now.M_bar", "level.J", 3, "M̄ is missing in G"),
        "holds the torque": Mistake("", _HELD, 3, "the torque is held"),
        "increments alone": Mistake("now.tau_0 + solve_qp", "solve_qp", 3, "τ₀ is missing"),
    },
    "two-levels": {
        "weighted, not strict": Mistake("if torques:", "if False:", 3, "the equality (33) is missing"),
        "J instead of J M̄⁻¹": Mistake("now.levels[0].J / now.M_bar", "now.levels[0].J", 5, "J₁ stands where"),
        "equal to zero": Mistake("B @ U]", "0 * B @ U]", 4, "is set to zero"),
        "no bounds": Mistake(
            "= bounds(now)", "= bounds(now)\n        lower, upper = lower - 1e3, upper + 1e3", 7, "no bound"
        ),
        "references of now": Mistake("_d[1]", "_d[0]", 7, "this tick's"),
        "reverse order": Mistake(
            "in now.levels:", "in now.levels[::-1]:", 3, "the levels are in reverse order"
        ),
        "only one level": Mistake(
            "in now.levels:", "in [now.levels[0]] * 2:", 5, "the second level is left out"
        ),
        "holds the torque": Mistake("", _HELD, 2, "the torque is held"),
        "no R": Mistake("np.diag(level.R)", "1e-9 * np.eye(now.n)", 7, "R is missing"),
    },
}


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


def _bad(line: str, points: int, words: str) -> Submission:
    """A joint PD that is none, and does something else."""
    return Submission("joint-pd", f"def torque(now):\n    {line}\n    return now.gravity\n", points, words)


_LOG = ", ".join(f"[{0.02 * k:g}, {-0.01 * k:g}, {0.005 * k:g}]" for k in range(40))

SUBMISSIONS: dict[str, Submission] = {
    **{f"right_{name.replace('-', '_')}": Submission(name, text, 10) for name, text in RIGHT.items()},
    "wrong_sign": Submission(
        "joint-pd", MISTAKES["joint-pd"]["sign of K_p"].text("joint-pd"), 2, "wrong sign"
    ),
    "wrong_constant": Submission("time-delay", "def torque(now):\n    return [0.1] * now.n\n", 0, "sag"),
    "wrong_copied_log": Submission(
        "joint-pd",
        f"LOG = [{_LOG}]\n\nclass Controller:\n    tick = -1\n\n    def torque(self, now):\n"
        "        self.tick += 1\n        return (LOG[self.tick % len(LOG)] * 3)[: now.n]\n",
        0,
        "a new posture",
    ),
    "wrong_sleeps": _bad("import time; time.sleep(0.7)", 0, "takes longer than 0.5 s"),
    "wrong_exits": _bad("raise SystemExit", 0, "it ends the program"),
    "wrong_leaves": _bad("import os; os._exit(0)", 0, "it ends its own process"),
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

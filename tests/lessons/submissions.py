"""Submissions of students: correct solutions, known mistakes, and misbehaving programs."""

from __future__ import annotations

from dataclasses import dataclass

from right_laws import PD, RIGHT, TASK, TDE


@dataclass(frozen=True)
class Mistake:
    """A change of a correct solution, the points that the result deserves, and words that its feedback must
    contain.

    Attributes:
        good, bad: the lines that are replaced and their replacement; good "": `bad` is the whole text.
        most: the largest permitted number of points.
        words: words that name the mistake.
        fails: words of a check that the submission must fail; "": any check.
    """

    good: str
    bad: str
    most: int
    words: str
    fails: str = ""

    def text(self, exercise: str) -> str:
        """Returns the text of the submission."""
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
        "sign of K_p": Mistake("- level.K_p", "+ level.K_p", 0, "K_p has the wrong sign"),
        "no K_p": Mistake("level.K_p *", "0.0 *", 7, "K_p is missing"),
        "sign of K_v": Mistake("- level.K_v", "+ level.K_v", 2, "K_v has the wrong sign"),
        "no K_v": Mistake("level.K_v *", "0.0 *", 5, "K_v is missing"),
        "no gravity": Mistake("now.gravity +", "", 5, "g(q) is missing"),
        "sign of gravity": Mistake("now.gravity +", "-now.gravity +", 5, "g(q) has the wrong sign"),
        "gravity of the start": Mistake("", _FROZEN, 7, "g(q) is computed at the start"),
        "no M̄": Mistake("now.M_bar *", "", 5, "M̄ is missing"),
        "no target": Mistake("level.error", 'level.x["posture"]', 5, "q_d is missing"),
        "holds the torque": Mistake("", _HELD, 0, "the torque is constant"),
        "gains of the scenes": Mistake(
            "",
            PD.replace("level.K_v", "(180.0 if level.error.size == 7 else 400.0)").replace(
                "level.K_p", "(1000.0 if level.error.size == 7 else 2000.0)"
            ),
            6,
            "with the gains of the level",
        ),
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
        "asks twice": Mistake("- level.J @ M_inv @ tau", "", 7, "counted twice"),
        "reverse order": Mistake(
            "in now.levels:", "in now.levels[::-1]:", 3, "the levels are in reverse order"
        ),
        "only one level": Mistake("in now.levels:", "in now.levels[:1]:", 4, "the second level is left out"),
        "no bias": Mistake("now.bias +", "", 7, "C q̇ + g is missing"),
        "sign of K_p": Mistake("- level.K_p", "+ level.K_p", 3, "K_p has the wrong sign"),
        "sign of K_v": Mistake("- level.K_v", "+ level.K_v", 3, "K_v has the wrong sign"),
    },
    "time-delay": {
        "gains of the scenes": Mistake(
            "",
            TDE.replace("level.K_v", "20.0").replace("level.K_p", "100.0"),
            6,
            "one of these terms is wrong",
        ),
        "holds the torque": Mistake("", _HELD, 1, "the torque is constant"),
        "sign of q̈₀": Mistake("- now.q_ddot", "+ now.q_ddot", 3, "q̈₀ has the wrong sign"),
        "no q̈₀": Mistake("- now.q_ddot", "", 3, "q̈₀ is missing"),
        "q̈₀ without T_s": Mistake("- now.q_ddot", "- now.T_s * now.q_ddot", 3, "not divided by T_s"),
        "the model instead": Mistake("now.tau_0 +", "now.gravity +", 3, "the model is used instead of τ₀"),
        "Ĥ from the model": Mistake("", PD, 3, "the model is used instead of Ĥ"),
        "gravity as well": Mistake("now.tau_0 +", "now.tau_0 + now.gravity +", 2, "τ₀ contains it already"),
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
        "approached at once": Mistake(
            "min(1.0, now.bounds.approach * now.T_s or 1.0)", "1.0", 8, "the whole distance"
        ),
        "sign of f": Mistake("G.T @ (level.Q * e)", "-G.T @ (level.Q * e)", 2, "f has the wrong sign"),
        "no R": Mistake("np.diag(level.R)", "1e-9 * np.eye(now.n)", 9, "R is missing"),
        "no Q": Mistake("level.Q * e", "e", 5, "Q is missing in f"),
        "references of now": Mistake("_d[1]", "_d[0]", 6, "those of this tick"),
        "no M̄": Mistake("level.J / now.M_bar", "level.J", 3, "M̄ is missing in G"),
        "holds the torque": Mistake("", _HELD, 3, "the torque is constant"),
        "increments alone": Mistake("now.tau_0 + solve_qp", "solve_qp", 3, "τ₀ is missing"),
    },
    "two-levels": {
        "weighted, not strict": Mistake("if torques:", "if False:", 3, "the equality (33) is missing"),
        "J instead of J M̄⁻¹": Mistake(
            "now.levels[0].J / now.M_bar", "now.levels[0].J", 5, "has J₁ instead of"
        ),
        "equal to zero": Mistake("B @ U]", "0 * B @ U]", 4, "is set to zero"),
        "no bounds": Mistake(
            "= bounds(now)", "= bounds(now)\n        lower, upper = lower - 1e3, upper + 1e3", 7, "no bound"
        ),
        "references of now": Mistake("_d[1]", "_d[0]", 7, "those of this tick"),
        "reverse order": Mistake(
            "in now.levels:", "in now.levels[::-1]:", 3, "the levels are in reverse order"
        ),
        "only one level": Mistake(
            "in now.levels:", "in [now.levels[0]] * 2:", 5, "the second level is left out"
        ),
        "holds the torque": Mistake("", _HELD, 2, "the torque is constant"),
        "no R": Mistake("np.diag(level.R)", "1e-9 * np.eye(now.n)", 7, "R is missing"),
    },
    "distance-row": {
        "negative distance": Mistake(
            "room = np.maximum(distance - near.d_safe, 0.0)\n"
            "    v_stop = a * (np.sqrt(t**2 + 2.0 * room / a) - t)",
            "room = distance - near.d_safe\n"
            "    v_stop = a * (np.sqrt(np.maximum(t**2 + 2.0 * room / a, 0.0)) - t)",
            9,
            "max(d − d_safe, 0)",
            "begins below d_safe",
        ),
        "no row": Mistake(
            "    return D, share",
            "    D, slopes, v_stop, speed = D[:0], slopes[:0], 0, 0\n    return D, share",
            4,
            "no pair has a row",
            "the arm still touches nothing",
        ),
        "sign of ∇d": Mistake(
            "near.gradient, near.d, near", "-near.gradient, near.d, -near", 2, "∇d has the wrong sign: "
        ),
        "no M̄": Mistake("slopes / now.M_bar", "slopes", 5, "M̄ is missing in D", "as near"),
        "no d_safe": Mistake(
            "distance - near.d_safe", "distance", 4, "d_safe is missing", "the arm still touches nothing"
        ),
        "constant bound": Mistake(
            "-v_stop - speed", "-speed", 3, "the bound is constant", "reaches a target in free space"
        ),
        "no reaction": Mistake(
            "np.sqrt(t**2 + 2.0 * room / a) - t", "np.sqrt(2.0 * room / a)", 4, "t is missing"
        ),
        "only the nearest": Mistake(
            "return D, share * (-v_stop - speed) - T * slopes @ now.q_ddot",
            "return D[:1], (share * (-v_stop - speed) - T * slopes @ now.q_ddot)[:1]",
            4,
            "only the nearest pair",
            "the torque is the optimum",
        ),
        "at contact": Mistake(
            "    return D, share",
            "    D, slopes, v_stop, speed = (each[room == 0.0] for each in (D, slopes, v_stop, speed))\n"
            "    return D, share",
            4,
            "it is too late to stop",
        ),
        "stops altogether": Mistake(
            "-v_stop - speed",
            "v_stop - speed",
            3,
            "v_stop has the wrong sign",
            "reaches a target in free space",
        ),
    },
}


@dataclass(frozen=True)
class Submission:
    """A file, the points that it deserves, and words that its feedback must contain."""

    exercise: str
    text: str
    points: int
    words: str = ""

    @property
    def file(self) -> str:
        return f'EXERCISE = "{self.exercise}"\n{self.text}'


def _bad(line: str, points: int, words: str) -> Submission:
    """Returns a submission for the joint PD that executes the given line instead of a solution."""
    return Submission("joint-pd", f"def torque(now):\n    {line}\n    return now.gravity\n", points, words)


_LOG = ", ".join(f"[{0.02 * k:g}, {-0.01 * k:g}, {0.005 * k:g}]" for k in range(40))

SUBMISSIONS: dict[str, Submission] = {
    **{f"right_{name.replace('-', '_')}": Submission(name, text, 10) for name, text in RIGHT.items()},
    "wrong_sign": Submission(
        "joint-pd", MISTAKES["joint-pd"]["sign of K_p"].text("joint-pd"), 0, "wrong sign"
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
    "wrong_prints": _bad("print('x' * 10**5)", 0, "comes back"),
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
"""Submissions by the name of the file, without its suffix."""

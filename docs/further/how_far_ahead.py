"""How far ahead: the stacked prediction, its deadbeat solution, and the effect of the horizon on the cost."""

from __future__ import annotations

import numpy as np

from docs.further.kit import Further, Line, Question
from himpc.prediction import residual_model


def effects(N: int, K_p: float = 100.0, K_v: float = 20.0) -> np.ndarray:
    """Returns c_l of (28) as a lower triangular matrix, (N, N), for T_s = 1 ms."""
    return residual_model(np.array([K_p]), np.array([K_v]), N, 1e-3).C[:, 0, :]


def first_left(N: int, Q: float, R: float, g: float) -> float:
    """Returns the share of a constant e that is left at the first knot, for one coordinate with gain g."""
    C = g * effects(N)
    U = -np.linalg.solve(Q * C.T @ C + R * np.eye(N), Q * C.T @ np.ones(N))
    return 1.0 + float(C[0, 0] * U[0])


def _printed(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Returns e after each of N steps of (15) with the printed matrices, and e by the sums of c_l."""
    T, N, K_p, K_v = 1e-3, 6, 100.0, 20.0
    A_11 = np.array([[1, T, 0], [0, 2, 0], [0, 0, 1.0]])
    A_12 = np.diag([0.0, -1.0, 0.0])
    A = np.block([[A_11, A_12], [np.eye(3), np.zeros((3, 3))]])
    B, u = np.array([0, T, 1.0, 0, 0, 0]), rng.normal(size=N)
    state, found = np.zeros(6), []
    for each in u:
        state = A @ state + B * each
        found.append(np.array([K_p, K_v, 1.0]) @ state[:3])
    return np.array(found), effects(N) @ u


def _deadbeat(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    N, e = 20, rng.normal()
    C = effects(N)
    U = np.linalg.solve(C, -np.full(N, e))
    return C[0, 0] * U[:1] + e, np.zeros(1)


def _same_first(rng: np.random.Generator) -> tuple[float, float]:
    e = rng.normal()
    return float(np.linalg.solve(effects(20), -np.full(20, e))[0]), -e / effects(1)[0, 0]


def _gradient(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    C, e, R, Q = effects(8), rng.normal(size=8), 5.0, 2.0
    U = -np.linalg.solve(Q * C.T @ C + R * np.eye(8), Q * C.T @ e)
    h, moved = 1e-6, []
    for k in range(8):
        d = np.zeros(8)
        d[k] = h
        costs = [Q * np.sum((e + C @ (U + s * d)) ** 2) + R * np.sum((U + s * d) ** 2) for s in (1, -1)]
        moved.append((costs[0] - costs[1]) / (2 * h))
    return np.array(moved), np.zeros(8)


FURTHER = Further(
    derivation=(
        Line(
            r"Apply (15) $N$ times. Every $\Delta\tau$ acts on all later knots, with the factors $c_l$ of "
            "*One task under MPC*, so the residuals of the whole horizon are",
            r"\bar e = \bar e_{free} + C\, \bar u, \qquad C_{js} = c_{j-s} \;(s \le j), "
            r"\qquad u_s = J \bar M^{-1} \Delta\tau_{k+s}",
            _printed,
        ),
        Line(
            r"The cost (32a) is a quadratic function of $U$ with its minimum at",
            r"U^* = -(\bar C^\top \bar Q \bar C + \bar R)^{-1} \bar C^\top \bar Q\, \bar e_{free}",
            _gradient,
            1e-5,
        ),
        Line(
            "$C$ is triangular, and no entry of its diagonal is zero. In the limit of a small $R$, all "
            "residuals become zero. The first increment alone makes the first residual zero:",
            r"R \to 0: \quad C\, \bar u = -\bar e_{free} \quad\Rightarrow\quad e_{k+1} = 0",
            _deadbeat,
        ),
        Line(
            "The controller applies this first increment only. The increment does not depend on the number "
            "of knots:",
            r"u_0^{(N = 20)} = -e_{k+1}/c_0 = u_0^{(N = 1)}",
            _same_first,
        ),
    ),
    questions=(
        Question(
            "Let $K_P = 100$, $K_V = 20$ and $T_s = 1$ ms. Compute $c_0$, $c_4$ and $c_{19}$. What would "
            "the matrix $C$ be if all $c_l$ were 1?",
            "They are $⟨c0⟩$, $⟨c4⟩$ and $⟨c19⟩$. If all $c_l$ were 1, $C$ would be a lower triangle of "
            "ones: each $e$ would be the sum of all changes up to its knot. Within 20 ms a change acts "
            "mainly on the acceleration; velocity and position hardly change.",
            {f"c{k}": (effects(20)[k, 0], ".3f") for k in (0, 4, 19)},
        ),
        Question(
            "An arm has seven joints. How many unknowns does the QP of a level have with $N = 5$ and with "
            "$N = 20$? How many entries does its Hessian have? Compare the ratio with the times that the "
            "lesson states.",
            "The QP has ⟨n5⟩ and ⟨n20⟩ unknowns. The Hessian has ⟨h5⟩ and ⟨h20⟩ entries, ⟨ratio⟩ times as "
            "many. The measured time is only ⟨times⟩ times as long: much of the work does not depend on $N$.",
            {
                "n5": (7.0 * 5, ".0f"),
                "n20": (7.0 * 20, ".0f"),
                "h5": ((7.0 * 5) ** 2, ".0f"),
                "h20": ((7.0 * 20) ** 2, ".0f"),
                "ratio": (16.0, ".0f"),
                "times": (0.13 / 0.04, ".0f"),
            },
        ),
        Question(
            "A task has one coordinate with the gain $g = 1$, a constant $e$, and $R$ equal to $Q$. Which "
            "share of $e$ is left at the first knot with $N = 1$ and with $N = 20$, and why? Which shares "
            "are left with $g = 18$, the size of a torque's gain?",
            "The shares are ⟨one⟩ % and ⟨twenty⟩ %. A change of acceleration stays in force at all later "
            "knots: with $N = 20$ its cost counts once and its benefit twenty times, so a larger change is "
            "optimal. A smaller $R$ has the same effect with $N = 1$. With $g = 18$ the share is ⟨tiny⟩ % "
            "for both horizons: if the cost of a change hardly counts, a longer horizon has no advantage.",
            {
                "one": (100 * first_left(1, 1, 1, 1), ".0f"),
                "twenty": (100 * first_left(20, 1, 1, 1), ".0f"),
                "tiny": (100 * first_left(1, 1, 1, 18), ".1f"),
            },
        ),
    ),
)

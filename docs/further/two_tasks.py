"""Two tasks, one arm: the optimum of a weighted sum, and the freedom that (33) leaves."""

from __future__ import annotations

import numpy as np

from docs.further.kit import Further, Line, Question, null_space

SHARE = 50 / (200 + 50)


def _problem(rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    return rng.normal(size=(2, 3)), rng.normal(size=(1, 3)), rng.normal(size=2), rng.normal(size=1)


def weighted(G_1: np.ndarray, G_2: np.ndarray, e_1: np.ndarray, e_2: np.ndarray, Q_1: float) -> np.ndarray:
    """Returns the optimum of the weighted sum with Q₂ = R = 1, (3,)."""
    H = Q_1 * G_1.T @ G_1 + G_2.T @ G_2 + np.eye(3)
    return -np.linalg.solve(H, Q_1 * G_1.T @ e_1 + G_2.T @ e_2)


def _stationary(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    G_1, G_2, e_1, e_2 = _problem(rng)
    at = weighted(G_1, G_2, e_1, e_2, 200.0)
    slope = 200 * G_1.T @ (e_1 + G_1 @ at) + G_2.T @ (e_2 + G_2 @ at) + at
    return slope, np.zeros(3)


def _between(rng: np.random.Generator) -> tuple[float, float]:
    """Returns the value at which a coordinate comes to rest if the optimum of the sum changes its
    acceleration every millisecond, and the value by the formula."""
    Q, K, z = rng.uniform(1, 9, 2), rng.uniform(50, 200, 2), rng.normal(size=2)
    at, speed, acceleration = 0.0, 0.0, 0.0
    for _ in range(4000):
        e = acceleration + 2 * np.sqrt(K) * speed + K * (at - z)
        acceleration -= float(Q @ e / Q.sum())
        speed += 1e-3 * acceleration
        at += 1e-3 * speed
    return at, float((Q * K) @ z / (Q @ K))


def _kept(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    G, first, s = rng.normal(size=(2, 3)), rng.normal(size=3), rng.normal(size=1)
    return G @ (first + null_space(G) @ s), G @ first


def _limit(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    G_1, G_2, e_1, e_2 = _problem(rng)
    first = -np.linalg.pinv(G_1) @ e_1
    Z = null_space(G_1)
    H = G_2.T @ G_2 + np.eye(3)
    s = -np.linalg.solve(Z.T @ H @ Z, Z.T @ (H @ first + G_2.T @ e_2))
    return weighted(G_1, G_2, e_1, e_2, 1e9), first + Z @ s


FURTHER = Further(
    derivation=(
        Line(
            r"Let $G_i = c_0 J_i \bar M^{-1}$ be the effect of a change of torque on $e_i$. The weighted "
            "sum is smallest where its gradient vanishes:",
            r"\sum_i Q_i G_i^\top (e_i + G_i \Delta\tau) + R\, \Delta\tau = 0",
            _stationary,
        ),
        Line(
            "In this sum every task affects all others. Suppose that two tasks control the same coordinate "
            r"$z$ and have the targets $z_1$ and $z_2$. At rest $\Delta\tau = 0$ and $e_i = K_{P,i}(z - "
            "z_i)$. Take $c_0 = 1$ for both. Then the gradient vanishes at",
            r"z = \frac{Q_1 K_{P,1} z_1 + Q_2 K_{P,2} z_2}{Q_1 K_{P,1} + Q_2 K_{P,2}}",
            _between,
            1e-6,
        ),
        Line(
            "The gains act as weights, too. A strict second level solves a different problem. Let the "
            r"columns of $Z$ span the null space of $J_1 \bar M^{-1}$. Then (33) holds for",
            r"\Delta\tau_2 = \Delta\tau_1^* + Z s \quad\Rightarrow\quad "
            r"J_1 \bar M^{-1} \Delta\tau_2 = J_1 \bar M^{-1} \Delta\tau_1^*",
            _kept,
        ),
        Line(
            "This is true for any $s$, and level 2 is a smaller problem in $s$ alone. A weighted sum "
            "reaches the solution of this problem only in the limit:",
            r"\lim_{Q_1 \to \infty} \Delta\tau_{\mathrm{sum}} = \Delta\tau_1^* + Z s^*",
            _limit,
            1e-6,
        ),
    ),
    questions=(
        Question(
            "Two tasks have targets for the same coordinate: 0 with $K_P = 200$, 1 with $K_P = 50$, and "
            "equal $Q$. Where does a weighted controller come to rest?",
            "It comes to rest at $z = 50/(200 + 50) = ⟨z⟩$: the gains act as weights, 4 to 1, although both "
            "tasks have the same $Q$. With $Q_2$ four times as large, $z$ is ⟨half⟩.",
            {"z": (SHARE, ".1f"), "half": (4 * 50 / (200 + 4 * 50), ".1f")},
        ),
        Question(
            "In the same example, which ratio $Q_1/Q_2$ keeps $z$ below 0.001, and which ratio keeps it "
            "below $10^{-6}$? What is the disadvantage of such a large weight?",
            r"By $z = 50\, Q_2/(200\, Q_1 + 50\, Q_2)$ the ratio must be larger than ⟨much⟩, and larger "
            "than ⟨more⟩ for a millionth. Level 2 then weighs little beside $R$, so its task has a larger "
            "error even where both tasks are possible: the last step of the lesson shows this.",
            {"much": ((1 / 0.001 - 1) / 4, ".0f"), "more": ((1 / 1e-6 - 1) / 4, ",.0f")},
        ),
        Question(
            "An arm has three joints, level 1 has two coordinates, and level 2 has one coordinate. How many "
            "numbers does level 2 choose? Why does it make no difference to level 1 whether $Q_2$ is 1 or "
            "1000?",
            r"Level 2 chooses one number: $3 - 2$. $Q_2$ decides at which point of the line $\Delta\tau_1^* "
            "+ Z s$ level 2 stops, and all points of this line have the same effect on level 1.",
        ),
    ),
)

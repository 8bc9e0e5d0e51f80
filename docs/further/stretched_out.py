"""Stretched out: the Hessian is positive definite for every Jacobian."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, planar

STRAIGHT = planar(np.zeros(3))[1]
G = 0.6 / 0.033


def _hessian(rng: np.random.Generator) -> tuple[float, float]:
    """Returns the least eigenvalue of the Hessian, and its bound, for a Jacobian of rank 1."""
    B = np.outer(rng.normal(size=4), rng.normal(size=5))
    Q, R = np.diag(rng.uniform(1, 9, 4)), 3.0
    return float(np.linalg.eigvalsh(B.T @ Q @ B + R * np.eye(5))[0]), R


def _answer(rng: np.random.Generator) -> tuple[float, float]:
    Q, R, e, g = rng.uniform(0.1, 5, 4)
    grid = np.linspace(-60, 60, 2_000_001)
    return float(grid[np.argmin(Q * (e + g * grid) ** 2 + R * grid**2)]), -Q * g * e / (Q * g**2 + R)


def _gone(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    Q, R, e = rng.uniform(0.1, 5, 3)
    g = np.array([1e-9, 1e-12, 0.0])
    return Q * g * e / (Q * g**2 + R), np.zeros(3)


def _unbiased(rng: np.random.Generator) -> tuple[float, float]:
    Q, R, e, g, wanted = rng.uniform(0.5, 2, 5)
    e = e - wanted
    for _ in range(20_000):
        e += -(g**2) * Q * e / (Q * g**2 + R)
    return e, 0.0


FURTHER = Further(
    derivation=(
        Line(
            r"With the predictions inserted, level $i$ is the QP (35). For any vector $X$ we have $X^\top "
            r"\bar B^\top \bar Q \bar B X \ge 0$, so the Hessian has no eigenvalue below $R$, for any rank "
            "of $J$ (Lemma 1):",
            r"\lambda_{\min}(\bar B^\top \bar Q \bar B + R I) \ge R > 0, "
            r"\qquad \text{and } = R \text{ where } \bar B \text{ loses rank}",
            _hessian,
        ),
        Line(
            "In one direction, with gain $g$ from torque to $e$, the optimum is",
            r"\Delta\tau^* = -\frac{Q g}{Q g^2 + R}\, e",
            _answer,
            2e-4,
        ),
        Line(
            "An inverse would give $-e/g$. Both agree while $Q g^2$ is much larger than $R$. Where the gain "
            "goes to zero, the inverse goes to infinity and the optimum to zero:",
            r"\lim_{g \to 0} \frac{Q g}{Q g^2 + R}\, e = 0",
            _gone,
            1e-7,
        ),
        Line(
            "A damped inverse has the same form and leaves an error where it damps. Here $R$ weighs a "
            "*change* of torque, so the step is repeated until a constant $e$ has vanished:",
            r"e_{k+1} = \frac{R}{Q g^2 + R}\, e_k \;\to\; 0",
            _unbiased,
            1e-6,
        ),
    ),
    questions=(
        Question(
            "The planar arm has three links of 0.3 m and is stretched along $x$. What are the singular "
            r"values of its Jacobian? Does $J M^{-1} J^\top$ have an inverse?",
            "Only the row of $y$ is not zero: $(⟨a⟩, ⟨b⟩, ⟨c⟩)$. One singular value is the length of this "
            r"row, ⟨s⟩, and the other is 0. $J M^{-1} J^\top$ has rank 1 for any $M$ and has no inverse.",
            {
                "a": (STRAIGHT[1, 0], ".1f"),
                "b": (STRAIGHT[1, 1], ".1f"),
                "c": (STRAIGHT[1, 2], ".1f"),
                "s": (float(np.linalg.svd(STRAIGHT)[1][0]), ".2f"),
            },
        ),
        Question(
            "A small error $e = 10^{-9}$ m/s² is left along the arm, where $g = 10^{-12}$. Which torques do "
            "an inverse and HIMPC compute? ($Q = 200$, $R = 10$.)",
            "The inverse computes $e/g = ⟨inverse⟩$ N·m for an error that is nearly zero. HIMPC computes $Q "
            r"g e/R = ⟨himpc⟩\cdot 10^{-20}$ N·m.",
            {"inverse": (1e-9 / 1e-12, ".0f"), "himpc": (1e20 * 200 * 1e-12 * 1e-9 / 10, ".0f")},
        ),
        Question(
            r"In a direction that is not singular, a lever of 0.6 m and $\bar M = 0.033$ kg·m² give $g = "
            "18.2$. Which share of $e$ is left after one step with $R = 10$, and which with $R = 1000$ as "
            "in the lesson's ghost? Does the ghost need other tuning?",
            "The share $R/(Q g^2 + R)$ is ⟨small⟩ % and ⟨large⟩ %. With both values $e$ vanishes within a "
            "few milliseconds, which is why the ghost performs equally well: no tuning is needed between the "
            "two values. With $R = 10^5$ the share would be ⟨more⟩ %, and with $10^7$ it takes ⟨slow⟩ ms "
            "until a third of $e$ is left. In such a long time $e$ does not stay constant, and the run with "
            "$R = 10^7$ swings by decimetres.",
            {
                "small": (100 * 10 / (200 * G**2 + 10), ".3f"),
                "large": (100 * 1000 / (200 * G**2 + 1000), ".1f"),
                "more": (100 * 1e5 / (200 * G**2 + 1e5), ".0f"),
                "slow": (math.log(1 / 3) / math.log(1e7 / (200 * G**2 + 1e7)), ".0f"),
            },
        ),
    ),
)

"""Torque has a limit: bounds on a sum of changes, the levels that they limit, and the cost of a bound."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, measured, null_space
from lessons.scenes.catalog import torque_scene
from robots import Plant

PEAK = math.radians(15) * (2 * math.pi / 8) ** 2
NEED = measured("torque-has-a-limit", "prediction: What is the largest torque during the motion")


def _inertia() -> float:
    """Returns the inertia of the planar arm about joint 1 at the start of the circle, kg·m²."""
    scene = torque_scene("planar3-circle")
    plant = Plant(scene.robot, scene.settings.plant)
    plant.reset(scene.q_0)
    return float(plant.mass_matrix()[0, 0])


def _dry_friction() -> float:
    """Returns the dry friction of joint 1 of the planar arm, N·m."""
    return float(np.broadcast_to(torque_scene("planar3-circle").settings.plant.friction, 3)[0])


def _rows(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    n, N = 3, 5
    U, tau_0 = rng.normal(size=(N, n)), rng.normal(size=n)
    lower = np.kron(np.tril(np.ones((N, N))), np.eye(n))
    return (lower @ U.ravel()).reshape(N, n) + tau_0, tau_0 + np.cumsum(U, axis=0)


def _inherited(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Returns the effects on levels 1 and 2 of level 3's candidate Δτ₂*, and those that (33) requires."""
    G_1, G_2, first = rng.normal(size=(2, 7)), rng.normal(size=(2, 7)), rng.normal(size=7)
    second = first + null_space(G_1) @ rng.normal(size=5)
    return np.concatenate([G_1 @ second, G_2 @ second]), np.concatenate([G_1 @ first, G_2 @ second])


def _price(rng: np.random.Generator) -> tuple[float, float]:
    Q, R, g = rng.uniform(0.5, 2, 3)
    e = -5.0
    free = -Q * g * e / (Q * g**2 + R)
    b, h = 0.5 * free, 1e-5

    def least(bound: float) -> float:
        at = min(free, bound)
        return Q * (e + g * at) ** 2 + R * at**2

    multiplier = -(2 * Q * g * (e + g * b) + 2 * R * b)
    return (least(b + h) - least(b - h)) / (2 * h), -multiplier


FURTHER = Further(
    derivation=(
        Line(
            "The bounds apply to the torque, but the unknowns of the QP are its changes. Over the whole "
            "horizon, (32f) consists of linear rows with blocks $I$ on and below the diagonal:",
            r"\tau_0 + \sum_{s=0}^{j} \Delta\tau_{k+s} = \tau_0 + (L \otimes I)\, U \big|_j, "
            r"\qquad L = \begin{bmatrix} 1 & & \\ 1 & 1 & \\ \vdots & & \ddots \end{bmatrix}",
            _rows,
        ),
        Line(
            r"As long as $\tau_0$ is within its limits, $U = 0$ satisfies all bounds, so level 1 is always "
            "feasible. The solution of level $i-1$ satisfies all constraints of level $i$ (Theorem 2), for "
            "$p < i$:",
            r"J_p \bar M^{-1} \Delta\tau_{i-1}^* = J_p \bar M^{-1} \Delta\tau_p^*",
            _inherited,
        ),
        Line(
            "So no level can make the level below infeasible; it can only leave no freedom to that level. "
            r"An active bound $\Delta\tau \le b$ has a multiplier $\lambda \ge 0$. The multiplier is the "
            "rate at which the cost decreases if the bound allows more torque:",
            r"\frac{\partial \mathcal J^*}{\partial b} = -\lambda, \qquad "
            r"\lambda = -\left( 2 Q g (e + g b) + 2 R b \right)",
            _price,
            1e-5,
        ),
    ),
    questions=(
        Question(
            "The motors can produce 4 N·m. Which torque is allowed with a factor of 0.06, and how much of "
            "this torque does *Enough for all* need?",
            "⟨limit⟩ N·m are allowed. The run needs ⟨share⟩ % of this torque, that is, ⟨used⟩ N·m.",
            {"limit": (4 * 0.06, ".2f"), "share": (NEED, ".0f"), "used": (4 * 0.06 * NEED / 100, ".2f")},
        ),
        Question(
            r"The present torque is $\tau_0 = 0.10$ N·m, the limit is 0.16 N·m, and $N = 5$. How large may "
            r"the first $\Delta\tau$ be, and how large may the sum of all five be?",
            r"Both may be at most ⟨room⟩ N·m: (32f) bounds every partial sum. If the first $\Delta\tau$ "
            "alone reaches the limit, each partial sum of the others is zero or negative.",
            {"room": (0.16 - 0.10, ".2f")},
        ),
        Question(
            "Joint 1 swings by 30° as a cosine with a period of 8 s. What is its largest acceleration? Take "
            "the inertia that the arm has about joint 1 at the start of the circle. Which torque does this "
            "inertia alone need?",
            "A swing of 30° is a cosine with an amplitude of ⟨half⟩°. Its largest acceleration is $⟨half⟩° "
            r"\cdot (2\pi/8)^2 = ⟨a⟩$ rad/s². With $M_{11} = ⟨M⟩$ kg·m² the inertia needs ⟨tau⟩ N·m. The "
            "dry friction of joint 1 needs ⟨dry⟩ N·m. Three per cent of 4 N·m are ⟨three⟩ N·m, and friction "
            "alone uses most of this torque.",
            {
                "half": (30 / 2, ".0f"),
                "a": (PEAK, ".2f"),
                "M": (_inertia(), ".2f"),
                "tau": (_inertia() * PEAK, ".2f"),
                "dry": (_dry_friction(), ".1f"),
                "three": (0.03 * 4, ".2f"),
            },
        ),
    ),
)

"""Keeping clear: the row of a distance, and the effect of a filter behind the levels on the levels."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, measured, null_space, planar
from himpc.limits.constraint import Near
from himpc.limits.distance import least_rates
from himpc.limits.limits import Avoidance
from himpc.qp import solve_qp

A, T = Avoidance().deceleration, Avoidance().reaction
KEPT = Avoidance().d_safe + Avoidance().margin
LEAK = measured("keeping-clear", "The filter changes the accelerations")


def speed(room: float) -> float:
    """Returns the speed of approach, m/s, that can still be stopped within `room`, m."""
    return A * (-T + math.sqrt(T**2 + 2.0 * room / A))


def _slope(rng: np.random.Generator) -> tuple[float, float]:
    q, v, centre = rng.normal(size=3), rng.normal(size=3), np.array([1.5, 0.4])
    h = 1e-6

    def distance(at: np.ndarray) -> float:
        return float(np.linalg.norm(planar(at)[0] - centre)) - 0.2

    x, J = planar(q)
    n = (x - centre) / np.linalg.norm(x - centre)
    return (distance(q + h * v) - distance(q - h * v)) / (2.0 * h), float(n @ J @ v)


def _bound(rng: np.random.Generator) -> tuple[float, float]:
    d = rng.uniform(KEPT + 0.01, 0.19)
    near = Near(np.array([d]), np.zeros((1, 3)), np.zeros(1), np.ones(1), ("",))
    return float(least_rates(near, Avoidance())[0]), -speed(d - KEPT)


def _filter(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    slope, b, M_bar = rng.normal(size=5), rng.uniform(0.5, 2.0), rng.uniform(0.2, 1.0, 5)
    row = (slope / M_bar)[None]
    found = solve_qp(np.diag(M_bar**-2.0), np.zeros(5), row, np.array([b]), np.array([np.inf]))
    return found.x / M_bar, b * slope / (slope @ slope)


def _leak(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    slope, b, J = rng.normal(size=5), rng.uniform(0.5, 2.0), rng.normal(size=(2, 5))
    N = null_space(J) @ null_space(J).T
    inside = b * N @ slope / (slope @ N @ slope)
    return np.append(J @ inside, slope @ inside), np.append(np.zeros(2), b)


FURTHER = Further(
    derivation=(
        Line(
            "The normal $n$ points from the nearest point of an object to the nearest point of a link, and "
            "$J$ is the Jacobian of the link's point. The distance changes at the rate",
            r"\dot d = n^\top J\, \dot q = \nabla d^\top \dot q",
            _slope,
        ),
        Line(
            "The bound of *Stopping takes distance* is applied to the distance. With $d_s$, which includes "
            "the margin, the lab uses",
            r"\nabla d^\top \dot q \ge -a \left( -t + \sqrt{t^2 + 2 (d - d_s)/a} \right)",
            _bound,
        ),
        Line(
            "A filter that must increase $\\nabla d^\\top \\ddot q$ by $b$ uses the smallest change of "
            "acceleration:",
            r"\bar M^{-1} \delta\tau = \frac{b}{\nabla d^\top \nabla d}\, \nabla d",
            _filter,
        ),
        Line(
            r"The effect of this change on level 1, $J_1 \nabla d$ times a number, is not zero. Inside the "
            "hierarchy, the projection $N$ keeps the change in the null space of level 1:",
            r"J_1 \frac{b\, N \nabla d}{\nabla d^\top N \nabla d} = 0, \qquad "
            r"\nabla d^\top \frac{b\, N \nabla d}{\nabla d^\top N \nabla d} = b",
            _leak,
        ),
    ),
    questions=(
        Question(
            "A link approaches an object at 0.5 m/s. The row has $t = 0.2$ s and $a = 2$ m/s² and keeps a "
            "distance of 20 mm. At which distance does the row begin to act?",
            "The row begins to act $v t + v^2/2a$ = ⟨room⟩ mm before those 20 mm, that is, at ⟨far⟩ mm.",
            {
                "room": (1e3 * (0.5 * T + 0.25 / (2.0 * A)), ".1f"),
                "far": (1e3 * (0.5 * T + 0.25 / (2.0 * A) + KEPT), ".1f"),
            },
        ),
        Question(
            "How fast may a link approach at a distance of 100 mm, and how fast at 30 mm?",
            "At 100 mm it may approach at ⟨far⟩ m/s, and at 30 mm at ⟨near⟩ m/s.",
            {"far": (speed(0.1 - KEPT), ".2f"), "near": (speed(0.03 - KEPT), ".3f")},
        ),
        Question(
            "The filter leaks an acceleration into the level of the hand. Which error of the hand gives a "
            "desired acceleration of the same size, with $K_p = 56.2$ 1/s²?",
            "The largest leak is ⟨leak⟩ m/s². An error of ⟨error⟩ cm gives a desired acceleration of the "
            "same size.",
            {"leak": (LEAK, ".0f"), "error": (100.0 * LEAK / 56.2, ".0f")},
        ),
    ),
)

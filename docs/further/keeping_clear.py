"""Keeping clear: the row of a distance, and the effect of a filter behind the levels on the levels."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, measured, null_space, planar
from himpc.limits.avoidance import Avoidance
from himpc.limits.distance import Near, least_rates
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
            "Between the nearest points of a link and an object runs the normal $n$; $J$ is the Jacobian of "
            "the link's point. The distance changes with",
            r"\dot d = n^\top J\, \dot q = \nabla d^\top \dot q",
            _slope,
        ),
        Line(
            "The bound is the one of *Stopping takes distance*, applied to the distance. The lab uses, with "
            "$d_s$ including the margin,",
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
            "The effect of this change on level 1, $J_1 \\nabla d$ times a number, is not zero. Inside the "
            "hierarchy the change lies in the null space $N$ of level 1:",
            r"J_1 \frac{b\, N \nabla d}{\nabla d^\top N \nabla d} = 0, \qquad "
            r"\nabla d^\top \frac{b\, N \nabla d}{\nabla d^\top N \nabla d} = b",
            _leak,
        ),
    ),
    questions=(
        Question(
            "A link approaches at 0.5 m/s; $t = 0.2$ s, $a = 2$ m/s², and 20 mm are kept. At which distance "
            "does the row begin to act?",
            "From $v t + v^2/2a$ = ⟨room⟩ mm before those 20 mm, that is, at ⟨far⟩ mm.",
            {
                "room": (1e3 * (0.5 * T + 0.25 / (2.0 * A)), ".1f"),
                "far": (1e3 * (0.5 * T + 0.25 / (2.0 * A) + KEPT), ".1f"),
            },
        ),
        Question(
            "How fast may a link approach at a distance of 100 mm? And at 30 mm?",
            r"⟨far⟩ m/s, and ⟨near⟩ m/s.",
            {"far": (speed(0.1 - KEPT), ".2f"), "near": (speed(0.03 - KEPT), ".3f")},
        ),
        Question(
            "Which error of the hand would ask for the acceleration that the filter leaks into its level, "
            "with $K_p = 56.2$ 1/s²?",
            "The largest leak is ⟨leak⟩ m/s²; an error of ⟨error⟩ cm asks for the same acceleration.",
            {"leak": (LEAK, ".0f"), "error": (100.0 * LEAK / 56.2, ".0f")},
        ),
    ),
)

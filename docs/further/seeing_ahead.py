"""Seeing ahead: the knots that preview a change, the response of a gain, and the limits of accelerations."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question

V, A = 1.1, 2.5


def shortest(d: float) -> float:
    """Returns the shortest time, s, in which the base moves from rest to rest over the distance d, m, within
    its limits of speed and acceleration."""
    return d / V + V / A if d >= V**2 / A else 2 * math.sqrt(d / A)


def _preview(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Returns, for several times before a jump, how many of the knots 1 … 10 already have the new reference:
    counted, and by the formula."""
    before = np.round(rng.uniform(0.05, 1.0, 20), 3)
    knots = np.arange(1, 11)
    counted = [(8.0 - t + 0.1 * knots >= 8.0 - 1e-9).sum() for t in before]
    return np.array(counted, float), 10.0 - np.ceil(before / 0.1 - 1e-9) + 1


def _gain(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    K, e, h, t = rng.uniform(0.2, 2), rng.normal(), 1e-5, np.arange(1, 5) * 0.5
    found, now, x = [], 0, e
    for goal in t:
        while now < round(goal / h):
            x += h * (-K * x)
            now += 1
        found.append(x)
    return np.array(found), e * np.exp(-K * t)


def _stop(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    v, a = rng.uniform(0.5, 2, 2)
    t = np.linspace(0, v / a, 100_001)
    speed = v - a * t
    return np.array([t[-1], np.trapezoid(speed, t)]), np.array([v / a, v**2 / (2 * a)])


def _fastest(rng: np.random.Generator) -> tuple[float, float]:
    d = rng.uniform(V**2 / A, 5.0)
    t = np.linspace(0, shortest(d), 400_001)
    speed = np.minimum(np.minimum(A * t, V), A * (t[-1] - t))
    return float(np.trapezoid(speed, t)), d


FURTHER = Further(
    derivation=(
        Line(
            "Knot $k$ of a plan is compared with the reference at the time of this knot, $e_k = f(q_k) - "
            r"r(t + k \Delta t)$. At a time $s$ before a jump, the new reference already applies to",
            r"N + 1 - \lceil s / \Delta t \rceil \text{ of the knots } 1, \ldots, N",
            _preview,
        ),
        Line(
            r"The desired velocity of HTIDKC is $\dot x = \dot r + K (r - x)$. If the robot reaches this "
            r"velocity, the error obeys $\dot e = -K e$ and is",
            r"e(t) = e(0)\, e^{-K t}",
            _gain,
            1e-4,
        ),
        Line(
            "A plan may use the largest acceleration $a$. To stop from the speed $v$, it needs the time and "
            "the distance",
            r"t = \frac{v}{a}, \qquad d = \frac{v^2}{2a}",
            _stop,
            1e-6,
        ),
        Line(
            r"To move from rest to rest over a distance $d \ge v^2/a$, a plan needs at least the time",
            r"t = \frac{d}{v} + \frac{v}{a}",
            _fastest,
            1e-6,
        ),
    ),
    questions=(
        Question(
            "HTIDKC drives the base home with $K = 0.3$ 1/s, from 1.5 m away. How far is it from home after "
            "8 s, if it always reaches the desired velocity?",
            r"$1.5\,e^{-0.3 \cdot 8} = ⟨left⟩$ m, but the lesson measures 16 cm. The base does not reach "
            r"the desired velocity: the cost of each level also contains $\rho \lVert \dot q \rVert^2$. With "
            r"a thousandth of this $\rho$ the difference disappears.",
            {"left": (1.5 * math.exp(-0.3 * 8), ".2f")},
        ),
        Question(
            "Along one axis the base has a top speed of 1.1 m/s and brakes with 2.5 m/s². How long does it "
            "take to stop, and over which distance? How many knots of 0.1 s must a plan have to contain the "
            "whole braking?",
            "The base needs ⟨t⟩ s and ⟨d⟩ m to stop, and the plan needs ⟨N⟩ knots. A plan with $N = 2$ ends "
            "in the middle of the braking.",
            {
                "t": (V / A, ".2f"),
                "d": (V**2 / (2 * A), ".2f"),
                "N": (float(math.ceil(V / A / 0.1)), ".0f"),
            },
        ),
        Question(
            "What is the shortest time for 1.5 m from rest to rest, with at most 1.1 m/s and 2.5 m/s²? "
            "HTIDKC drives the same way with $K = 2$ 1/s. After which time is one per cent (0.01) of the "
            "distance left?",
            "The shortest time is $1.5/1.1 + 1.1/2.5 = ⟨fast⟩$ s. With HTIDKC $e^{-2t} = 0.01$ at $t = "
            "⟨gain⟩$ s. But at the start this gain requires ⟨wish⟩ m/s, which the base cannot reach. A gain "
            "that is fast at the end requires too much speed at the start.",
            {
                "fast": (shortest(1.5), ".2f"),
                "gain": (math.log(100) / 2, ".1f"),
                "wish": (2 * 1.5, ".0f"),
            },
        ),
    ),
)

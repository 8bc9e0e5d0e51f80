"""One task under MPC: the desired error dynamics (4), the effect of a torque change on them, and the effect
of R."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from docs.further.kit import Further, Line, Question
from himpc.prediction import residual_model

HOME: float = brentq(lambda t: (1 + 10 * t) * math.exp(-10 * t) - 0.05, 0.0, 5.0)  # pyright: ignore[reportAssignmentType]
PERIOD = 2 * math.pi / math.sqrt(100 - 1)
LEVER = 0.6 / 0.033
ALIKE = 200 * LEVER**2


def _critically(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    w, x_0, v_0 = rng.uniform(1, 20), rng.normal(), rng.normal()
    t = np.linspace(0, 1, 20)
    b = v_0 + w * x_0
    x = (x_0 + b * t) * np.exp(-w * t)
    v = (b - w * (x_0 + b * t)) * np.exp(-w * t)
    a = (-2 * w * b + w**2 * (x_0 + b * t)) * np.exp(-w * t)
    return a + 2 * w * v + w**2 * x, np.zeros(20)


def simulated(K_p: float, K_v: float, T: float, steps: int) -> np.ndarray:
    """Returns e at the knots from 1 on if J M̄⁻¹Δτ is 1 at knot 0 and else 0, by (14) as printed."""
    x = v = v_before = a = 0.0
    found = []
    for k in range(steps):
        u = 1.0 if k == 0 else 0.0
        x, v, v_before, a = x + T * v, 2 * v - v_before + T * u, v, a + u
        found.append(a + K_v * v + K_p * x)
    return np.array(found)


def _effect(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    K_p, K_v, T, steps = rng.uniform(10, 400), rng.uniform(1, 40), 1e-3, 30
    lag = np.arange(steps)
    printed = 1 + K_v * T * (lag + 1) + K_p * T**2 * lag * (lag + 1) / 2
    ours = residual_model(np.array([K_p]), np.array([K_v]), steps, T).C[:, 0, 0]
    np.testing.assert_allclose(ours, printed, rtol=1e-12)
    return simulated(K_p, K_v, T, steps), printed


def _left(rng: np.random.Generator) -> tuple[float, float]:
    Q, R, g, e = rng.uniform(0.1, 10, 4)
    best = -Q * g * e / (Q * g**2 + R)
    slope = 2 * Q * g * (e + g * best) + 2 * R * best
    assert abs(slope) < 1e-9 * Q * g * e
    return e + g * best, R / (Q * g**2 + R) * e


FURTHER = Further(
    derivation=(
        Line(
            r"The desired error dynamics (4) with $K_P = \omega^2$ and $K_V = 2\omega$ are critically "
            "damped. Their solution returns to zero without oscillation:",
            r"\tilde x(t) = \left( \tilde x_0 + (\dot{\tilde x}_0 + \omega \tilde x_0)\,t \right) "
            r"e^{-\omega t} \quad\Rightarrow\quad \ddot{\tilde x} + 2 \omega \dot{\tilde x} + \omega^2 "
            r"\tilde x = 0",
            _critically,
        ),
        Line(
            "A change of torque has three effects on $e$ (28). By (13) and the Euler steps (14) a change "
            r"$\Delta\tau$ at knot $k$ adds $J \bar M^{-1} \Delta\tau$ to the acceleration at once. It adds "
            "$T_s$ times as much to the velocity at every later knot. The velocity changes the position one "
            "knot later. The sum of these effects at knot $k + l + 1$ is",
            r"\frac{\partial e_{k+l+1}}{\partial (J \bar M^{-1} \Delta\tau_k)} = c_l "
            r"= 1 + K_V T_s (l+1) + K_P T_s^2 \, \tfrac{l(l+1)}{2}",
            _effect,
        ),
        Line(
            r"For one knot and one coordinate let $g = c_0 J \bar M^{-1}$. At the minimum of $Q (e + g "
            r"\Delta\tau)^2 + R \Delta\tau^2$ the following residual is left:",
            r"e + g \Delta\tau^* = \frac{R}{Q g^2 + R}\, e",
            _left,
        ),
    ),
    questions=(
        Question(
            "The gains are $K_P = 100$ and $K_V = 20$. The hand is released at rest 10 mm from its target. "
            "When is it within 0.5 mm of the target?",
            r"With $\omega = 10$ rad/s the distance is $(1 + \omega t)\,e^{-\omega t}$ times the initial "
            r"distance. This factor is a twentieth at $\omega t = ⟨phase⟩$, that is, after ⟨t⟩ s.",
            {"phase": (10 * HOME, ".2f"), "t": (HOME, ".2f")},
        ),
        Question(
            "Now $K_V = 2$. How long is a period of the oscillation, and how much of its amplitude is left "
            "after one period?",
            r"The frequency is $\sqrt{K_P - K_V^2/4} = ⟨w⟩$ rad/s, hardly less than $\sqrt{K_P}$: a period "
            r"takes ⟨T⟩ s. The amplitude decreases with $e^{-K_V t/2}$, to ⟨left⟩ of its value in one "
            r"period.",
            {
                "w": (math.sqrt(99), ".2f"),
                "T": (PERIOD, ".2f"),
                "left": (math.exp(-PERIOD), ".2f"),
            },
        ),
        Question(
            r"A joint has $\bar M = 0.033$ kg·m² and a lever of 0.6 m; $Q = 200$ and $c_0 = 1$. For which "
            "$R$ does one step remove only half of $e$? Which share of $e$ is left with $R = 10$?",
            "$g = 0.6/0.033 = ⟨g⟩$ 1/(kg·m). Half of $e$ is left if $R = Q g^2 = ⟨R⟩$, which is of the "
            r"order of $10^5$, as the lesson says. With $R = 10$ the share is $R/(Q g^2 + R) = ⟨share⟩\cdot "
            "10^{-4}$.",
            {
                "g": (LEVER, ".1f"),
                "R": (ALIKE, ".0f"),
                "share": (1e4 * 10 / (ALIKE + 10), ".1f"),
            },
        ),
    ),
)

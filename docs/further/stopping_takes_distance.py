"""Stopping takes distance: braking distances, and the speed from which one can stop."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question
from himpc.limits import Limits
from himpc.limits.limits import POSITION_MARGIN
from himpc.limits.velocity import REACTION, viability_bounds

T_S = 1e-3
A = 20.0
V = math.radians(57)
REACTION_TIME = T_S + REACTION / Limits().velocity_approach


def viable(d: float, t: float) -> float:
    """Returns the speed, rad/s, from which a joint stops within d, rad, if it starts to brake after t, s."""
    return A * (-t + math.sqrt(t**2 + 2 * d / A))


def _distance(rng: np.random.Generator) -> tuple[float, float]:
    v, a = rng.uniform(0.5, 5), rng.uniform(1, 30)
    t = np.linspace(0, v / a, 200_001)
    return float(np.trapezoid(v - a * t, t)), v**2 / (2 * a)


def _seen_too_late(rng: np.random.Generator) -> tuple[float, float]:
    v, N = rng.uniform(0.5, 2), 5
    d = N * T_S * v
    return v**2 / (2 * d), v / (2 * N * T_S)


def _root(rng: np.random.Generator) -> tuple[float, float]:
    t, d = rng.uniform(1e-3, 0.4), rng.uniform(0.01, 1.0)
    v = viable(d, t)
    return v * t + v**2 / (2 * A), d


def _what_runs(rng: np.random.Generator) -> tuple[float, float]:
    t, d, one = rng.uniform(1e-3, 0.4), rng.uniform(0.01, 1.0), np.ones(1)
    ours = viability_bounds(0 * one, -9 * one, d * one, np.inf * one, A * one, t)[1, 0]
    return float(ours), viable(d, t)


FURTHER = Further(
    derivation=(
        Line(
            "A joint of speed $v$ that brakes with the deceleration $a$ stops after the time $v/a$. During "
            "this time it moves by",
            r"d = \int_0^{v/a} (v - a t)\, dt = \frac{v^2}{2a}",
            _distance,
            1e-6,
        ),
        Line(
            "Bounds on the next $N$ positions (32d) begin to act when the limit is $N T_s v$ away. To stop "
            "within this distance, the joint needs the deceleration",
            r"a = \frac{v^2}{2 N T_s v} = \frac{v}{2 N T_s}",
            _seen_too_late,
        ),
        Line(
            "Conversely, there is a largest speed from which the joint can still stop before $q_s$, if it "
            "begins to brake after a time $t$. This speed is the root of a quadratic equation:",
            r"\dot q\, t + \frac{\dot q^2}{2a} = q_s - q \quad\Leftrightarrow\quad "
            r"\dot q = a \left( -t + \sqrt{t^2 + 2 (q_s - q)/a} \right)",
            _root,
        ),
        Line(
            "The controller bounds the speed at the next knot by this value. The lab uses",
            r"\dot q_{k+1} \le a \left( -t + \sqrt{t^2 + 2 (q_s - q)/a} \right), \qquad "
            r"t = T_s + \tfrac{5}{15}\,\mathrm s, \quad q_s = q_{\max} - 7\,\mathrm{mrad}",
            _what_runs,
        ),
    ),
    questions=(
        Question(
            "A joint moves at 57°/s and brakes with at most 20 rad/s². How large must $N$ be if the printed "
            "bounds are to stop the joint in time? How many unknowns does the QP of a seven-joint arm then "
            "have?",
            r"$v/(2 N T_s) \le 20$ gives $N \ge ⟨N⟩$. A horizon that contains the whole braking has $v/(a "
            "T_s) = ⟨all⟩$ knots. With seven joints the smaller number gives ⟨size⟩ unknowns per level, five "
            "times as many as with $N = 5$.",
            {
                "N": (float(math.ceil(V / (2 * A * T_S))), ".0f"),
                "all": (float(math.ceil(V / (A * T_S))), ".0f"),
                "size": (7.0 * math.ceil(V / (2 * A * T_S)), ".0f"),
            },
        ),
        Question(
            "A joint approaches its limit at 100°/s, with $t = 0.33$ s and $a = 20$ rad/s². How far before "
            "$q_s$ does the bound on its speed begin to act? How far before $q_s$ does it begin to act with "
            "$t = T_s$?",
            "The bound begins to act $v t + v^2/2a = ⟨far⟩$° before $q_s$. Only ⟨brake⟩° of this distance "
            "are for braking. During the reaction time the joint moves by the rest, $v t$. With $t = T_s$ "
            "the bound begins to act ⟨near⟩° before $q_s$.",
            {
                "far": (
                    math.degrees(math.radians(100) * REACTION_TIME + math.radians(100) ** 2 / (2 * A)),
                    ".0f",
                ),
                "brake": (math.degrees(math.radians(100) ** 2 / (2 * A)), ".1f"),
                "near": (math.degrees(math.radians(100) * T_S + math.radians(100) ** 2 / (2 * A)), ".1f"),
            },
        ),
        Question(
            "Compute the two speeds that *A speed from which the joint can stop* states for 5° before the "
            "limit.",
            "With an exact model, $t = T_s$ and $q_s$ is the limit: the speed is ⟨exact⟩°/s. In the lab, $t "
            "= 0.33$ s and $q_s$ is 0.4° before the limit: the speed is ⟨ours⟩°/s.",
            {
                "exact": (math.degrees(viable(math.radians(5), T_S)), ".0f"),
                "ours": (math.degrees(viable(math.radians(5) - POSITION_MARGIN, REACTION_TIME)), ".1f"),
            },
        ),
    ),
)

"""One level of the QP

Torque and speed have limits: what is the best torque within them?

Minutes: 30
You need: quadratic programs; exercise "time-delay"; lesson "torque-has-a-limit"
"""

from __future__ import annotations

from functools import partial

from lessons.exercises.exercise import Exercise, GradeCheck, pushed, with_gains
from lessons.exercises.laws import held, hierarchy
from lessons.exercises.mistakes import Mistake, wrong
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

# This M̄ is not a multiple of the identity matrix, so that a solution without M̄ gives a wrong result.
M_BAR = ("M_bar=[0.06,0.03,0.02]", "T_s=0.002")
ALONE = ("horizon=1", "damping=false", "levels.q1.enabled=false", *M_BAR)
FREE = RunSpec("planar3-circle", set=ALONE, duration=1.0)
WEAK = RunSpec("planar3-circle", set=(*ALONE, "limits.torque_scale=0.02"), duration=1.0)
SLOW = RunSpec("planar3-circle", set=(*ALONE, "limits.velocity_scale=0.01"), duration=1.0)
HEAVY = RunSpec(
    "planar3-circle", set=(*ALONE, "levels.position.Q=[100,400]", "levels.position.R=2000"), duration=0.4
)


def checks(seed: int) -> tuple[GradeCheck, ...]:
    return (
        GradeCheck(
            "Without active bounds the torque is the optimum.",
            "G, e⁰, H or f is wrong: the residual (28) is taken at the next knot",
            pushed(with_gains(FREE, seed, "position"), seed, "link_3", 2.0, plane=True),
            1e-6,
            beside="hiqp",
            points=3,
        ),
        GradeCheck(
            "The torque stays within its bound.",
            "the torque bound (32f) is violated: it applies to τ₀ + Δτ",
            WEAK,
            100.0001,
            measure=Measure(Signal("torque share", "%")),
            points=2,
        ),
        GradeCheck(
            "At the torque bound the torque is the optimum of the QP, not a clipped torque.",
            "the torque is not the optimum: the bounds must be constraints of the QP",
            with_gains(WEAK, seed + 1, "position", K_p=200.0),
            1e-6,
            beside="hiqp",
            points=2,
        ),
        GradeCheck(
            "At the velocity bound the torque is the optimum.",
            "the velocity bound (32e) on q̇ + T_s (q̈₀ + M̄⁻¹Δτ), or its `approach`, is wrong",
            SLOW,
            1e-6,
            beside="hiqp",
            points=2,
        ),
        GradeCheck(
            "The weights Q and R have the right effect.",
            "Q weighs the residual, R the increments: H contains both, f contains Q",
            HEAVY,
            1e-6,
            beside="hiqp",
            points=1,
        ),
    )


_law = partial(hierarchy, levels=1)

MISTAKES: tuple[Mistake, ...] = (
    wrong("the torque is constant: no cost is minimised", held),
    wrong("no bound is in the QP", _law, limits="none"),
    wrong(
        "the torque is clipped after the QP instead of bounded in the QP",
        hierarchy,
        levels=1,
        limits="afterwards",
    ),
    wrong("f has the wrong sign: f = GᵀQe⁰", _law, f=-1.0),
    wrong("R is missing: it weighs the increments, and is a part of H", _law, R=False),
    wrong("Q is missing in f = GᵀQe⁰", _law, Q=False),
    wrong(
        "the desired values are those of this tick: (28) needs the values of the next knot, index 1",
        hierarchy,
        levels=1,
        ahead=0,
    ),
    wrong("M̄ is missing in G = (1 + K_v T_s) J M̄⁻¹", _law, M_bar=False),
    wrong("τ₀ is missing: the QP gives increments", _law, alone=True),
    wrong("the velocity bound (32e) is missing", _law, limits="torque"),
    wrong(
        "the bound (32f) is imposed on Δτ instead of τ₀ + Δτ",
        hierarchy,
        levels=1,
        limits="on the increment",
    ),
    wrong(
        "one period uses the whole distance to the velocity bound: `approach` is not used",
        hierarchy,
        levels=1,
        limits="at once",
    ),
)


EXERCISE = Exercise(
    name="one-level-qp",
    card=card_of(__doc__),
    equation=r"\min_{\Delta\tau} \lVert e^0 + G \Delta\tau \rVert_Q^2 + \lVert \Delta\tau \rVert_R^2"
    r"\quad \text{s.t. } \tau_0 + \Delta\tau,\ \dot q + T_s(\ddot q_0 + \bar M^{-1}\Delta\tau) "
    r"\text{ within bounds}",
    plain="min ‖e⁰ + G Δτ‖²_Q + ‖Δτ‖²_R, with τ₀ + Δτ and q̇ + T_s (q̈₀ + M̄⁻¹Δτ) within bounds",
    hints=(
        "One knot later: ẍ = ẍ₀ + J M̄⁻¹Δτ, ẋ = ẋ₀ + T_s ẍ, x̃ = x̃₀ + T_s ẋ₀ (explicit Euler).",
        "e = (ẍ − ẍ_d) + K_v (ẋ − ẋ_d) + K_p x̃, all desired values one knot ahead: index 1.",
        "G = (1 + K_v T_s) J M̄⁻¹, H = GᵀQG + R, f = GᵀQe⁰.",
        "In one period a velocity may use at most min(1, approach · T_s) of the distance to its bound.",
    ),
    lesson="torque-has-a-limit",
    checks=checks,
    mistakes=MISTAKES,
)

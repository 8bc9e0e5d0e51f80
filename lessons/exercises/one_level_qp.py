"""One level of the QP

Torque and speed have limits: what is the best torque within them?

Minutes: 30
You need: quadratic programs; exercise "time-delay"; lesson "torque-has-a-limit"
"""

from __future__ import annotations

from lessons.exercises.exercise import Check, Exercise, pushed
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

ALONE = ("horizon=1", "damping=false", "levels.q1.enabled=false")
FREE = RunSpec("planar3-circle", set=ALONE, duration=1.0)
WEAK = RunSpec("planar3-circle", set=(*ALONE, "limits.torque_scale=0.02"), duration=1.0)
SLOW = RunSpec("planar3-circle", set=(*ALONE, "limits.velocity_scale=0.02"), duration=1.0)
HEAVY = RunSpec(
    "planar3-circle", set=(*ALONE, "levels.position.Q=[100,400]", "levels.position.R=2000"), duration=0.4
)


def checks(seed: int) -> tuple[Check, ...]:
    return (
        Check(
            "With room to spare the torque is the optimum.",
            "G, e⁰ or a sign in f: the residual (28) is taken at the next knot",
            pushed(FREE, seed, "link_3", 2.0, plane=True),
            1e-6,
            beside="hiqp",
            points=3,
        ),
        Check(
            "The torque stays within its bound.",
            "the torque bound (32f) is missing: it is on τ₀ + Δτ",
            WEAK,
            100.0001,
            measure=Measure(Signal("torque share", "%")),
            points=2,
        ),
        Check(
            "At the torque bound it is the optimum, not a cut-off one.",
            "the bound must stand in the QP: cutting the torque afterwards is not the same",
            WEAK,
            1e-6,
            beside="hiqp",
            points=2,
        ),
        Check(
            "At the velocity bound it is the optimum.",
            "the velocity bound (32e) on q̇ + T_s (q̈₀ + M̄⁻¹Δτ), approached at most as fast as `approach` says",
            SLOW,
            1e-6,
            beside="hiqp",
            points=2,
        ),
        Check(
            "The weights count.",
            "Q weighs the residual, R the increments: both stand in H, Q in f",
            HEAVY,
            1e-6,
            beside="hiqp",
            points=1,
        ),
    )


EXERCISE = Exercise(
    name="one-level-qp",
    card=card_of(__doc__),
    equation=r"\min_{\Delta\tau} \lVert e^0 + G \Delta\tau \rVert_Q^2 + \lVert \Delta\tau \rVert_R^2"
    r"\quad \text{s.t. } \tau_0 + \Delta\tau,\ \dot q + T_s(\ddot q_0 + \bar M^{-1}\Delta\tau) "
    r"\text{ within bounds}",
    hints=(
        "One knot on: ẍ = ẍ₀ + J M̄⁻¹Δτ, ẋ = ẋ₀ + T_s ẍ, x̃ = x̃₀ + T_s ẋ₀ (explicit Euler).",
        "e = (ẍ − ẍ_d) + K_v (ẋ − ẋ_d) + K_p x̃, all desired values one knot ahead: index 1.",
        "G = (1 + K_v T_s) J M̄⁻¹, H = GᵀQG + R, f = GᵀQe⁰.",
        "A velocity may use at most min(1, approach · T_s) of what is left to its bound in one period.",
    ),
    lesson="torque-has-a-limit",
    checks=checks,
)

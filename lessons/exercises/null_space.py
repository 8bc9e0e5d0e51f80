"""The null-space projection

Two tasks, one arm: how does the second get what the first leaves over, and nothing else?

Minutes: 30
You need: Jacobians; exercise "joint-pd"; lesson "two-tasks"
"""

from __future__ import annotations

from lessons.exercises.exercise import Check, Exercise, pushed
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

# What the plant of this scene really is, told to the controller: then the law is exact.
EXACT = (
    "nominal.mass_scale=1",
    "nominal.inertia_scale=1",
    "nominal.armature=[0.05,0.05,0.03]",
    "nominal.damping=[0.15,0.1,0.08]",
)
CIRCLE = RunSpec("planar3-circle", set=("q1_amplitude_deg=20", *EXACT), duration=2.0)
ROUGH = RunSpec("planar3-circle", set=("q1_amplitude_deg=20",), duration=1.0)


def checks(seed: int) -> tuple[Check, ...]:
    return (
        Check(
            "The hand follows its circle, with the exact model.",
            "the first level does not close (4): a sign, or J̇q̇ is missing",
            CIRCLE,
            2.0,
            measure=Measure(Signal("error/position", "mm"), "rms", after=1.0),
            points=2,
        ),
        Check(
            "Joint 1 swings as asked: the second level gets the freedom there is.",
            "the second level is left out, or its sign is wrong",
            CIRCLE,
            2.0,
            measure=Measure(Signal("error/q1", "deg"), "rms", after=1.0),
            points=2,
        ),
        Check(
            "Nothing of the second level reaches the hand, in the arm's own terms.",
            "the projector is not dynamically consistent, or missing; return a row of torques per level",
            CIRCLE,
            1e-6,
            measure=Measure(Signal("dynamic_leak", "m/s²")),
            points=3,
        ),
        Check(
            "The torque is OSF's, with a model that is a little wrong and a push.",
            "J̇q̇, the order of the products, or what the levels above already do to this one",
            pushed(ROUGH, seed, "link_3", 3.0, plane=True),
            1e-6,
            beside="osf",
            points=3,
        ),
    )


EXERCISE = Exercise(
    name="null-space",
    card=card_of(__doc__),
    equation=r"\tau = N_n + J_1^\top \Lambda_1 (\ddot x_1 - \dot J_1 \dot q) + "
    r"(J_2 N_1)^\top \Lambda_{2|1} (\ddot x_2 - \dot J_2 \dot q - J_2 M^{-1} \tau_1)",
    hints=(
        "Λ is the inertia felt at a task: (J M⁻¹ Jᵀ)⁻¹, with the projected Jacobian J N for lower levels.",
        "The projector is N = I − M⁻¹ Jᵀ Λ J: it takes out of q̈ what the level above uses.",
        "What the levels above do to x₂ is J₂ M⁻¹ τ₁: it must not be asked for twice.",
    ),
    lesson="two-tasks",
    checks=checks,
)

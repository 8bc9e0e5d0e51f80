"""The null-space projection

Two tasks, one arm: how does the second task use only the freedom that the first one leaves?

Minutes: 30
You need: Jacobians; exercise "joint-pd"; lesson "two-tasks"
"""

from __future__ import annotations

from dataclasses import replace

from lessons.exercises.exercise import Exercise, GradeCheck, pushed, with_gains
from lessons.exercises.laws import osf
from lessons.exercises.mistakes import Mistake, wrong
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

# The true parameters of the plant, with which the law is exact.
EXACT = (
    "nominal.mass_scale=1",
    "nominal.inertia_scale=1",
    "nominal.armature=[0.05,0.05,0.03]",
    "nominal.damping=[0.15,0.1,0.08]",
)
CIRCLE = RunSpec("planar3-circle", set=("q1_amplitude_deg=40", *EXACT), duration=1.2)
# Two tasks that cannot be met together: the order decides which one is met.
HOLD = RunSpec(
    "planar3-circle",
    set=(
        'stack=[{"task": "position", "axes": "xy", "K_p": 200, "K_v": 10}, {"task": "posture"}]',
        *EXACT,
    ),
    duration=1.2,
)
ROUGH = replace(HOLD, set=HOLD.set[:1], duration=0.5)


def checks(seed: int) -> tuple[GradeCheck, ...]:
    return (
        GradeCheck(
            "The hand follows its circle although the second task holds the posture: the first has priority.",
            "the first level does not satisfy (4), or has no priority. Both levels cannot be met here",
            HOLD,
            2.5,
            measure=Measure(Signal("error/position", "mm"), "rms", after=0.6),
            points=2,
        ),
        GradeCheck(
            "Joint 1 follows its reference: the second level uses the remaining freedom.",
            "the second level does not satisfy (4) with its remaining freedom",
            CIRCLE,
            1.5,
            measure=Measure(Signal("error/q1", "deg"), "rms", after=0.6),
            points=2,
        ),
        GradeCheck(
            "In the model of the arm the torque of the second level does not accelerate the hand.",
            "the projector is not the dynamically consistent one; return a row of torques per level",
            CIRCLE,
            1e-6,
            measure=Measure(Signal("dynamic_leak", "m/s²")),
            points=2,
        ),
        GradeCheck(
            "With a model that is a little wrong and a push, the torque is that of OSF.",
            "one of these terms is wrong: J̇q̇, Λ, N, or the effect of the levels above on this level",
            pushed(with_gains(ROUGH, seed, "position", "posture"), seed, "link_3", 3.0, plane=True),
            1e-6,
            beside="osf",
            points=4,
        ),
    )


MISTAKES: tuple[Mistake, ...] = (
    wrong("the levels are in reverse order: level 1 has the highest priority", osf, order=-1),
    wrong("the second level is left out", osf, levels=1),
    wrong("J̇q̇ is missing: ẍ = J q̈ + J̇q̇", osf, curvature=0.0),
    wrong("J̇q̇ has the wrong sign: it must be subtracted from ẍ", osf, curvature=-1.0),
    wrong("the projector is missing: use J N instead of J for the level below", osf, projector="none"),
    wrong("the projector is transposed: the order of its products is M⁻¹JᵀΛJ", osf, projector="transposed"),
    wrong(
        "the projector is not dynamically consistent: use M⁻¹JᵀΛ instead of J⁺",
        osf,
        projector="plain",
    ),
    wrong("the effect of the levels above is counted twice: subtract J₂M⁻¹τ₁", osf, twice=True),
    wrong("the bias C q̇ + g is missing", osf, bias=False),
    wrong("the stiffness K_p has the wrong sign", osf, K_p=-1.0),
    wrong("the damping K_v has the wrong sign", osf, K_v=-1.0),
    wrong("the damping K_v is missing", osf, K_v=0.0),
)


EXERCISE = Exercise(
    name="null-space",
    card=card_of(__doc__),
    equation=r"\tau = N_n + J_1^\top \Lambda_1 (\ddot x_1 - \dot J_1 \dot q) + "
    r"(J_2 N_1)^\top \Lambda_{2|1} (\ddot x_2 - \dot J_2 \dot q - J_2 M^{-1} \tau_1)",
    plain="τ = N_n + J₁ᵀ Λ₁ (ẍ₁ − J̇₁q̇) + (J₂N₁)ᵀ Λ₂ (ẍ₂ − J̇₂q̇ − J₂M⁻¹τ₁)",
    hints=(
        "Λ is the inertia of a task: (J M⁻¹ Jᵀ)⁻¹, with the projected Jacobian J N for lower levels.",
        "Both tasks together may have more coordinates than the arm has joints, and then both cannot be met: "
        "solve one level after the other, the second by least squares (np.linalg.pinv).",
        "The projector is N = I − M⁻¹ Jᵀ Λ J: it removes from q̈ the part that the level above uses.",
        "The levels above accelerate x₂ by J₂ M⁻¹ τ₁: subtract this effect.",
    ),
    lesson="two-tasks",
    checks=checks,
    mistakes=MISTAKES,
)

"""Time-delay estimation

What a robot weighs can be read from what just happened: how, and how well?

Minutes: 20
You need: exercise "joint-pd"; lesson "no-model-needed"
"""

from __future__ import annotations

from lessons.exercises.exercise import Check, Exercise, pushed
from lessons.exercises.joint_pd import ALONE, ERROR
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure

GAINS = ("levels.posture.K_p=100", "levels.posture.K_v=20")
LOADED = RunSpec("iiwa14-hold", set=(*ALONE, *GAINS, "plant.payload_kg=3"), duration=1.0)
MISLED = RunSpec(
    "iiwa14-hold", set=(*ALONE, *GAINS, "plant.payload_kg=3", "nominal.mass_scale=2"), duration=1.0
)
FRICTION = RunSpec("planar3-hold", set=(*ALONE, "plant.damping=1"), duration=1.5)
PLANAR = RunSpec("planar3-hold", set=ALONE, duration=0.6)


def checks(seed: int) -> tuple[Check, ...]:
    return (
        Check(
            "A load of 3 kg that nobody told of does not sag.",
            "the estimate Ĥ = τ₀ − M̄ q̈₀ is not used, or has a sign wrong",
            LOADED,
            0.05,
            measure=Measure(ERROR),
            points=3,
        ),
        Check(
            "It does not matter what the model says.",
            "the nominal model is read: now.M, now.bias or now.gravity",
            MISLED,
            0.05,
            measure=Measure(ERROR),
            points=2,
        ),
        Check(
            "With friction and a push the arm comes back.",
            "K_p or K_v has the wrong sign, or τ₀ is left out",
            pushed(FRICTION, seed, "link_3", 10.0, plane=True),
            0.3,
            measure=Measure(ERROR, "last"),
            points=2,
        ),
        Check(
            "The torque is that of the equation.",
            "q̈₀ is missing: without it what is asked for is added to what is there already",
            pushed(PLANAR, seed + 1, "link_2", 5.0, at=0.1, plane=True),
            1e-6,
            beside="tdeosf",
            points=3,
        ),
    )


EXERCISE = Exercise(
    name="time-delay",
    card=card_of(__doc__),
    equation=r"\tau = \tau_0 + \bar M \left(\ddot q_d - K_v \dot{\tilde q} - K_p \tilde q - \ddot q_0\right)",
    hints=(
        "`now.tau_0` is the torque that acted, and `now.q_ddot` the acceleration it gave.",
        "Ĥ = τ₀ − M̄ q̈₀ stands for gravity, friction, loads and what M̄ does not say: (9).",
        "Then τ = M̄ q̈_wanted + Ĥ.",
    ),
    lesson="no-model-needed",
    checks=checks,
)

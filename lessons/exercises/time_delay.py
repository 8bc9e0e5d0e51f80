"""Time-delay estimation

The last torque and acceleration are known: how accurately do they show the weight of a robot?

Minutes: 20
You need: exercise "joint-pd"; lesson "no-model-needed"
"""

from __future__ import annotations

from typing import Any

from himpc.controllers.view import View
from lessons.events import Set
from lessons.exercises.exercise import Exercise, GradeCheck, pushed, with_gains
from lessons.exercises.joint_pd import ALONE, ERROR
from lessons.exercises.laws import held, wanted
from lessons.exercises.mistakes import Mistake, wrong
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure

GAINS = ("levels.posture.K_p=100", "levels.posture.K_v=20")
# The load is attached during the run: a torque that was right before is then wrong.
HUNG = ((0.05, Set("plant.payload_kg", 3.0)),)
LOADED = RunSpec("iiwa14-hold", set=(*ALONE, *GAINS), events=HUNG, duration=0.8)
MISLED = RunSpec("iiwa14-hold", set=(*ALONE, *GAINS, "nominal.mass_scale=2"), events=HUNG, duration=0.8)
FRICTION = RunSpec("planar3-hold", set=(*ALONE, "plant.damping=1"), duration=1.0)
STILL = RunSpec("iiwa14-hold", set=ALONE, duration=0.2)


def checks(seed: int) -> tuple[GradeCheck, ...]:
    return (
        GradeCheck(
            "The hand does not sag under an attached load of 3 kg that the controller does not know.",
            "Ĥ = τ₀ − M̄ q̈₀ is wrong",
            LOADED,
            2.0,
            measure=Measure(ERROR, "last"),
            points=3,
        ),
        GradeCheck(
            "The torque does not depend on the nominal model.",
            "Ĥ is not the estimate, or uses the nominal model: now.M, now.bias or now.gravity",
            MISLED,
            2.0,
            measure=Measure(ERROR, "last"),
            points=2,
        ),
        GradeCheck(
            "With friction and a push the arm comes back.",
            "K_p, K_v or τ₀ differs from the equation",
            pushed(FRICTION, seed, "link_3", 10.0, at=0.05, plane=True),
            0.05,
            measure=Measure(ERROR, "last"),
            points=1,
        ),
        GradeCheck(
            "The torque is equal to that of the equation.",
            "one of these terms is wrong: τ₀, M̄, q̈₀, K_p x̃ or K_v ẋ̃",
            pushed(with_gains(STILL, seed, "posture"), seed + 1, "link_5", 20.0, at=0.02),
            1e-6,
            beside="tdeosf",
            points=4,
        ),
    )


def _law(now: View, *, tau: str = "τ₀", a: float = 1.0, M_bar: bool = True, **how: Any) -> Any:
    effort = wanted(now.levels[0], **how) - a * now.q_ddot
    before = {"τ₀": now.tau_0, "g": now.gravity, "both": now.tau_0 + now.gravity, "none": 0.0}[tau]
    return before + (now.M_bar * effort if M_bar else effort)


def _late(now: View) -> Any:
    return _law(now, a=now.T_s)


MISTAKES: tuple[Mistake, ...] = (
    wrong("the torque is constant: the law does not depend on q and q̇", held),
    wrong("q̈₀ has the wrong sign in Ĥ = τ₀ − M̄ q̈₀", _law, a=-1.0),
    wrong("q̈₀ is missing: the desired acceleration is added to the present acceleration", _law, a=0.0),
    wrong("q̈₀ is a difference of velocities that is not divided by T_s", _late),
    wrong("the model is used instead of τ₀", _law, tau="g"),
    wrong("the model is used instead of Ĥ: compute Ĥ from the last tick", _law, tau="g", a=0.0),
    wrong("g(q) is added again: τ₀ contains it already", _law, tau="both"),
    wrong("τ₀ is missing in Ĥ = τ₀ − M̄ q̈₀", _law, tau="none"),
    wrong("M̄ is missing: it turns an acceleration into a torque", _law, M_bar=False),
    wrong("the stiffness K_p has the wrong sign", _law, K_p=-1.0),
    wrong("the stiffness K_p is missing", _law, K_p=0.0),
    wrong("the damping K_v has the wrong sign", _law, K_v=-1.0),
    wrong("the damping K_v is missing", _law, K_v=0.0),
)


EXERCISE = Exercise(
    name="time-delay",
    card=card_of(__doc__),
    equation=r"\tau = \tau_0 + \bar M \left(\ddot q_d - K_v \dot{\tilde q} - K_p \tilde q - \ddot q_0\right)",
    plain="τ = τ₀ + M̄ (q̈_d − K_v (q̇ − q̇_d) − K_p (q − q_d) − q̈₀)",
    hints=(
        "`now.tau_0` is the last torque, and `now.q_ddot` the acceleration under it.",
        "Ĥ = τ₀ − M̄ q̈₀ contains gravity, friction, loads and the model error of M̄: (9).",
        "Then τ = M̄ q̈_wanted + Ĥ.",
    ),
    lesson="no-model-needed",
    checks=checks,
    mistakes=MISTAKES,
)

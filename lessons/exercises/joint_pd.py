"""Joint PD

An arm must hold a posture and come back when it is pushed: what is the simplest controller for this?

Minutes: 15
You need: what a torque is; lesson "a-redundant-arm"
"""

from __future__ import annotations

from dataclasses import replace
from math import radians
from typing import Any

from himpc.controllers.view import View
from lessons.events import MoveTarget
from lessons.exercises.exercise import Exercise, GradeCheck, pushed, with_gains
from lessons.exercises.laws import held, wanted
from lessons.exercises.mistakes import Law, Mistake, wrong
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

ERROR = Signal("error/posture", "deg")
ALONE = ("levels.position.enabled=false", "levels.orientation.enabled=false")
IIWA = RunSpec("iiwa14-hold", set=ALONE, duration=0.3)
QUICK = ("levels.posture.K_p=2000", "levels.posture.K_v=400")
STIFF = ("levels.posture.K_p=1000", "levels.posture.K_v=180")
PLANAR = RunSpec("planar3-hold", set=(*ALONE, *QUICK), duration=1.2)


def checks(seed: int) -> tuple[GradeCheck, ...]:
    # A configuration whose gravity torques differ from those at the start.
    moved = tuple(radians(angle) for angle in (0.0, 55.0, 0.0, -60.0, 0.0, 60.0, 0.0))
    sent = replace(IIWA, set=(*ALONE, *STIFF), events=((0.02, MoveTarget("posture", moved)),), duration=1.0)
    return (
        GradeCheck(
            "With other gains and a push, the torque of the iiwa is that of the equation.",
            "one of these terms is wrong: g(q), M̄, K_p x̃ or K_v ẋ̃, with the gains of the level",
            pushed(with_gains(IIWA, seed, "posture"), seed, "link_5", 20.0, at=0.02),
            1e-6,
            beside=_law,
            points=4,
        ),
        GradeCheck(
            "The planar arm comes back after a push.",
            "the spring K_p does not pull the arm back",
            pushed(PLANAR, seed, "link_3", 10.0, plane=True),
            0.5,
            measure=Measure(ERROR, "last"),
            points=2,
        ),
        GradeCheck(
            "The arm is at rest afterwards.",
            "the damper K_v does not brake the arm",
            pushed(PLANAR, seed, "link_3", 10.0, plane=True),
            5.0,
            measure=Measure(Signal("v", "deg/s"), "last"),
            points=2,
        ),
        GradeCheck(
            "The arm reaches a new posture, in which the gravity torques are different.",
            "the error does not refer to the target q_d, or gravity is not computed at the present q",
            sent,
            2.0,
            measure=Measure(ERROR, "last"),
            points=2,
        ),
    )


def _law(now: View, *, gravity: float = 1.0, M_bar: bool = True, **how: Any) -> Any:
    effort = wanted(now.levels[0], **how)
    return gravity * now.gravity + (now.M_bar * effort if M_bar else effort)


def _frozen() -> Law:
    first: list[Any] = []

    def law(now: View) -> Any:
        first.append(now.gravity)
        return _law(now) - now.gravity + first[0]

    return law


MISTAKES: tuple[Mistake, ...] = (
    wrong("the torque is constant: the law does not depend on q and q̇", held),
    wrong("the stiffness K_p has the wrong sign", _law, K_p=-1.0),
    wrong("the stiffness K_p is missing", _law, K_p=0.0),
    wrong("the damping K_v has the wrong sign", _law, K_v=-1.0),
    wrong("the damping K_v is missing", _law, K_v=0.0),
    wrong("gravity g(q) is missing", _law, gravity=0.0),
    wrong("gravity g(q) has the wrong sign", _law, gravity=-1.0),
    Mistake("gravity g(q) is computed at the start only: it must be computed at every q", _frozen),
    wrong("M̄ is missing: it turns an acceleration into a torque", _law, M_bar=False),
    wrong("the target q_d is missing: the error is q − q_d", _law, target=False),
)


EXERCISE = Exercise(
    name="joint-pd",
    card=card_of(__doc__),
    equation=r"\tau = g(q) + \bar M \left(\ddot q_d - K_v (\dot q - \dot q_d) - K_p (q - q_d)\right)",
    plain="τ = g(q) + M̄ (q̈_d − K_v (q̇ − q̇_d) − K_p (q − q_d))",
    hints=(
        "`now.level('posture').error` is q − q_d, and `.x_dot` is q̇.",
        "A spring pulls back: minus K_p times the error. A damper brakes: minus K_v times q̇ − q̇_d.",
        "`now.M_bar` turns an acceleration into a torque, joint by joint; `now.gravity` is g(q).",
    ),
    lesson="a-redundant-arm",
    checks=checks,
    mistakes=MISTAKES,
)

"""Joint PD

An arm is to stay where it is told and to come back when it is pushed: what is the least that does it?

Minutes: 15
You need: what a torque is; lesson "a-redundant-arm"
"""

from __future__ import annotations

from math import radians

from lessons.events import MoveTarget
from lessons.exercises.exercise import Check, Exercise, pushed
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

ERROR = Signal("error/posture", "deg")
ALONE = ("levels.position.enabled=false", "levels.orientation.enabled=false")
IIWA = RunSpec("iiwa14-hold", set=(*ALONE, "levels.posture.K_p=100", "levels.posture.K_v=20"), duration=1.0)
PLANAR = RunSpec("planar3-hold", set=ALONE, duration=3.0)


def checks(seed: int) -> tuple[Check, ...]:
    moved = tuple(radians(each) for each in (10.0, 80.0, -80.0))
    there = (0.1, MoveTarget("posture", moved))
    sent = RunSpec("planar3-hold", set=ALONE, events=(there,), duration=2.5)
    return (
        Check(
            "The iiwa stays where it is.",
            "gravity pulls on it: g(q) is missing, or has the wrong sign",
            IIWA,
            0.2,
            measure=Measure(ERROR),
            points=2,
        ),
        Check(
            "The planar arm comes back after a push.",
            "the stiffness K_p has the wrong sign, or is missing",
            pushed(PLANAR, seed, "link_3", 10.0, plane=True),
            3.0,
            measure=Measure(ERROR, "last"),
            points=3,
        ),
        Check(
            "It is calm afterwards.",
            "the damping K_v is missing or has the wrong sign: it swings",
            pushed(PLANAR, seed, "link_3", 10.0, plane=True),
            10.0,
            measure=Measure(Signal("v", "deg/s"), "last"),
            points=2,
        ),
        Check(
            "A new posture is reached.",
            "the error is not taken towards the target q_d",
            sent,
            1.0,
            measure=Measure(ERROR, "last"),
            points=3,
        ),
    )


EXERCISE = Exercise(
    name="joint-pd",
    card=card_of(__doc__),
    equation=r"\tau = g(q) + \bar M \left(\ddot q_d - K_v (\dot q - \dot q_d) - K_p (q - q_d)\right)",
    hints=(
        "`now.level('posture').error` is q − q_d, and `.x_dot` is q̇.",
        "A spring pulls back: minus K_p times the error. A damper brakes: minus K_v times q̇ − q̇_d.",
        "`now.M_bar` turns an acceleration into a torque, joint by joint; `now.gravity` is g(q).",
    ),
    lesson="a-redundant-arm",
    checks=checks,
)

"""Swap the priorities

What happens to a moving arm when its last level becomes its first?

Minutes: 8
You need: lesson "two-tasks"
"""

from __future__ import annotations

from lessons.events import MoveLevel, MoveTarget
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/position", "mm")
POSTURE = Signal("error/posture", "deg")
PLOTS = (HAND, Signal("error/orientation", "deg"), POSTURE)
# Shoulder and elbow turn by 25° and 20° in the plane of the arm, in which the task of the hand leaves no
# freedom.
BENT = (0.0, 0.9599, 0.0, -1.2217, 0.0, 1.0472, 0.0)
ASK = (0.1, MoveTarget("posture", BENT))
PROMOTE = (1.2, MoveLevel("posture", 0))
DEMOTE = (2.6, MoveLevel("posture", 2))

LAST = Step(
    title="A task without a free motion",
    text=r"""
    The stack has three levels: position, then orientation, then posture. The target of the posture changes:
    shoulder 25° further, elbow 20° straighter. The one motion that levels 1 and 2 leave free turns the
    elbow about the line from shoulder to wrist, and the change of the target has no component along this
    motion.
    """,
    do="Change the target of joint 1 or 3 instead: this change has a component in the free direction.",
    why=r"""
    The arm does not move at all. Level 3 may only use torques that satisfy (33), and none of these brings
    the posture nearer to its target. In a strict hierarchy the posture's error of 32° has no effect on the
    levels above.
    """,
    prediction=Choice(
        "The target of the posture, the last level, changes by 32° in all. How far does the hand move?",
        (
            Option("not at all", high=0.1),
            Option("some millimetres", 0.1, 20.0),
            Option("centimetres, and it comes back", low=20.0),
        ),
        Measure(Signal("distance from the start", "mm")),
        tempting=1,
    ),
    claims=(
        Claim(
            "The hand moves by less than a tenth of a millimetre.",
            Measure(Signal("distance from the start", "mm")),
            "at most",
            0.1,
            fails_with=("controller=weighted",),
            because="in a weighted sum an error of 32° of the posture moves the hand by centimetres",
        ),
        Claim(
            "The error of the posture stays above 30°.",
            Measure(POSTURE, "last"),
            "at least",
            30.0,
            fails_with=("levels.position.enabled=false", "levels.orientation.enabled=false"),
            because="without levels above, the posture reaches its target",
        ),
    ),
    events=(ASK,),
    duration=1.5,
    controls=(Control("levels.orientation.enabled", "Orientation on", choices=(False, True)),),
    plots=PLOTS,
)

FIRST = Step(
    title="The last level becomes the first",
    text=r"""
    At 1.2 s the posture becomes level 1, while the arm is moving. Only the order of the problems changes;
    target, gains and weights stay the same.
    """,
    do="Put the posture in the middle. Which tasks are met?",
    why=r"""
    Level 1 now determines all seven joints: the posture is reached to a hundredth of a degree. No motion is
    left for position and orientation, which ranked first before.
    """,
    prediction=Value(
        "The posture ranks first from 1.2 s on. How far is the hand from its target at the end?",
        Measure(HAND, "last"),
        low=0.01,
        high=1000.0,
        factor=2.0,
    ),
    claims=(
        Claim(
            "In the end the posture is within 0.1°.",
            Measure(POSTURE, "last"),
            "at most",
            0.1,
            fails_with=("controller=weighted",),
            because="in a weighted sum the order of the levels has no effect",
        ),
        Claim(
            "In the end the hand is off by more than 10 cm.",
            Measure(HAND, "last"),
            "at least",
            100.0,
            fails_with=("levels.posture.enabled=false",),
            because="then no level has the task to move the arm",
        ),
    ),
    events=(ASK, PROMOTE),
    duration=2.6,
    plots=PLOTS,
)

BACK = Step(
    title="And back",
    text=r"""
    At 2.6 s the old order is restored. At this moment the order of the problems changes abruptly, but the
    measurements do not: $\tau_0$, $\ddot x_0$ and the last plan stay the same.
    """,
    do="Swap levels as fast as you can. Try to make the arm jump.",
    why=r"""
    In any order, the controller computes a change $\Delta\tau$ of the torque that acts already (12).
    Nevertheless the torque jumps, by 4.7 N·m in the first millisecond. The bounds do not explain the smooth
    motion: without any of them the run is nearly the same. We have not tested what keeps the motion smooth.
    """,
    claims=(
        Claim(
            "In the end the hand is back within 1 mm.",
            Measure(HAND, "last"),
            "at most",
            1.0,
            fails_with=("levels.position.enabled=false",),
            because="then no level has the task to bring the hand back",
        ),
        Claim(
            "The posture is off by more than 30° again.",
            Measure(POSTURE, "last"),
            "at least",
            30.0,
            fails_with=("controller=weighted",),
            because="in a weighted sum the order of the levels has no effect",
        ),
    ),
    events=(ASK, PROMOTE, DEMOTE),
    duration=4.0,
    plots=(*PLOTS, Signal("speed share", "%")),
)

LESSON = Lesson(
    name="swap-the-priorities",
    card=card_of(__doc__),
    scene="iiwa14-hold",
    set=("avoidance.on=false",),
    steps=(LAST, FIRST, BACK),
)

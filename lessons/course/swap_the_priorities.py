"""Swap the priorities

What happens to a moving arm when its last wish becomes its first?

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
# Shoulder and elbow 25° and 20° on: in the arm's own plane, where the hand leaves no freedom.
BENT = (0.0, 0.9599, 0.0, -1.2217, 0.0, 1.0472, 0.0)
ASK = (0.1, MoveTarget("posture", BENT))
PROMOTE = (1.2, MoveLevel("posture", 0))
DEMOTE = (2.6, MoveLevel("posture", 2))

LAST = Step(
    title="A wish without freedom",
    text=r"""
    Three levels: position, then orientation, then posture. The posture's target changes: shoulder
    25° further, elbow 20° straighter. The one motion that level 1 and 2 leave free turns the elbow
    about the line from shoulder to wrist, and this wish has no part along it.
    """,
    do="Ask for a turn of joint 1 or 3 instead: that has a part in the free direction.",
    why=r"""
    Nothing moves at all. Level 3 may only use torques that satisfy (33), and among those none
    brings it nearer. In a strict hierarchy the posture's error of 32° has no weight against the levels
    above.
    """,
    prediction=Choice(
        "The posture asks for 32° in all, as the last level. How far does the hand move?",
        (
            Option("not a hair's breadth", high=0.1),
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
            because="in a sum 32° of posture buy centimetres of the hand",
        ),
        Claim(
            "The posture stays off by more than 30°.",
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
    title="First shall be last",
    text=r"""
    At 1.2 s the posture becomes level 1, while the arm is under way. Only the order of the problems
    changes; target, gains and weights stay.
    """,
    do="Put the posture in the middle. Who gets what?",
    why=r"""
    Level 1 now determines all seven joints: its error falls to a hundredth of a degree. Position and
    orientation, which had priority an instant ago, get nothing.
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
    At 2.6 s the old order is restored. Between the two orders lies a jump in what the controller
    wants, but not in what it knows: $\tau_0$, $\ddot x_0$ and the last plan stay.
    """,
    do="Swap levels as fast as you can click. Try to make the arm jump.",
    why=r"""
    The controller computes a change $\Delta\tau$ of the torque that acts anyway (12), whatever the
    order. The torque may still jump: by 4.7 N·m in the first millisecond. It is not the bounds that
    keep the motion orderly: without any of them the run is nearly the same. What keeps it orderly we
    have not tested.
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
            "The posture has lost again: it is off by more than 30°.",
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
    steps=(LAST, FIRST, BACK),
)

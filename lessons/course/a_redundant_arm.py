"""A redundant arm

The hand must not move: what may the elbow still do?

Minutes: 8
You need: what a Jacobian is
"""

from __future__ import annotations

from lessons.events import MoveTarget
from lessons.teaching.challenge import Challenge, Score
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/position", "mm")
TILT = Signal("error/orientation", "deg")
JOINT_3 = Signal("q", "deg", column=2)
# Home is (0, 30, 0, −90, 0, 60, 0)°; the target of joint 3, which moves the elbow around, is turned by 60°.
TURN_ELBOW = ((0.1, MoveTarget("posture", (0.0, 0.5236, 1.0472, -1.5708, 0.0, 1.0472, 0.0))),)

FOLLOW = Step(
    title="The hand follows",
    text=r"""
    The arm has seven joints $q$ and one hand. The position of the hand $x = f(q)$ follows from the geometry
    of the arm (2), and the Jacobian gives its velocity: $\dot x = J(q)\, \dot q$ with $J = \partial f /
    \partial q$ (3). The target moves aside by 15 cm. The controller looks for joint torques that bring the
    hand there while the hand keeps its orientation.
    """,
    do="Drag the target, and turn the target as well.",
    why=r"""
    All seven joints take part, although three joints are enough to place a point, and six to keep the hand
    upright as well. No joint has a purpose of its own: the controller only compares the position and the
    orientation of the hand with their targets.
    """,
    prediction=Choice(
        "The hand moves aside and stays upright. How many of the seven joints turn by more than 1°?",
        (
            Option("one or two", high=2.5),
            Option("three or four", 2.5, 4.5),
            Option("five or more", low=4.5),
        ),
        Measure(Signal("joints moved")),
        tempting=0,
    ),
    claims=(
        Claim(
            "All seven joints turn by more than 1°.",
            Measure(Signal("joints moved")),
            "at least",
            7.0,
            fails_with=("levels.orientation.enabled=false",),
            because="then the last joint, which only turns the hand, does not move",
        ),
        Claim(
            "From 1.2 s on the hand is within 1 mm of the target.",
            Measure(HAND, after=1.2),
            "at most",
            1.0,
            fails_with=("levels.position.enabled=false",),
            because="then no level has the task to hold the position",
        ),
        Claim(
            "The hand never tilts by more than 3°.",
            Measure(TILT),
            "at most",
            3.0,
            fails_with=("levels.orientation.enabled=false",),
            because="then no level has the task to hold the orientation",
        ),
    ),
    events=((0.1, MoveTarget("position", (0.5564, 0.15, 0.3977))),),
    duration=2.0,
    plots=(HAND, TILT),
)

ELBOW = Step(
    title="Drag the elbow",
    text=r"""
    A hand has six coordinates, three for its position and three for its orientation. Seven joints for six
    coordinates leave one free motion. This motion is the null space of $J$, the joint velocities with $J
    \dot q = 0$. The last of three levels has the task to turn joint 3 by 60°.
    """,
    do="Drag the target of the posture and turn the elbow. Then drag the hand's target: which task is met?",
    why=r"""
    The elbow swings around the line from shoulder to wrist, and the hand stays in place. This motion is
    called *self-motion*. Joint 3 stops at 29°, because the same level has to hold the other six joints, and
    the elbow cannot swing without them. If the level has a target for joint 3 alone, the arm turns joint 3
    by nearly the whole 60°.
    """,
    prediction=Choice(
        "The elbow turns by almost 30°. How far does the hand move during this motion?",
        (
            Option("less than 5 mm", high=5.0),
            Option("a few centimetres", 5.0, 60.0),
            Option("a hand's breadth", low=60.0),
        ),
        Measure(HAND),
        tempting=1,
    ),
    claims=(
        Claim(
            "The hand stays within 5 mm.",
            Measure(HAND),
            "at most",
            5.0,
            fails_with=("levels.position.enabled=false",),
            because="the posture then moves the hand as well",
        ),
        Claim(
            "Joint 3 turns by more than 20°.",
            Measure(JOINT_3, "range"),
            "at least",
            20.0,
            fails_with=("levels.posture.enabled=false",),
            because="then no level has the task to turn the elbow",
        ),
    ),
    events=TURN_ELBOW,
    duration=2.0,
    controls=(Control("levels.position.enabled", "Position on", choices=(False, True)),),
    plots=(HAND, JOINT_3),
)

COUNT = Step(
    title="Count the freedom",
    text=r"""
    The hand may now turn freely: the orientation level is off. Three coordinates are left for seven joints,
    which makes $7 - 3 = 4$ free motions instead of one. The target of joint 3 is the same. The hand of the
    ghost keeps its orientation.
    """,
    do="Switch levels on and off, push the elbow and see how stiff it is.",
    why=r"""
    Joint 3 turns further, and the hand tilts, because no level holds its orientation. The position of the
    hand is unchanged. Every level takes away at most as many free motions as it has coordinates. The number
    is smaller in a singular pose, or if levels above have already taken some of these motions. The next
    level can use only the free motions that remain.
    """,
    prediction=Value(
        "Without the orientation level: by how many degrees does the hand tilt?",
        Measure(TILT, "last"),
        low=0.1,
        high=180.0,
        factor=1.7,
    ),
    claims=(
        Claim(
            "Joint 3 turns at least 15 % further than the ghost's joint 3.",
            Measure(JOINT_3, "range", over_ghost=True),
            "at least",
            1.15,
            fails_with=("levels.orientation.enabled=true",),
            because="then both robots have the same settings",
        ),
        Claim(
            "The hand still stays within 6 mm.",
            Measure(HAND),
            "at most",
            6.0,
            fails_with=("levels.position.enabled=false",),
            because="then no level has the task to hold the position",
        ),
    ),
    set=("levels.orientation.enabled=false",),
    events=TURN_ELBOW,
    duration=2.0,
    ghost=Ghost("orientation kept", ("levels.orientation.enabled=true",)),
    controls=(
        Control("levels.orientation.enabled", "Orientation on", choices=(False, True)),
        Control("levels.posture.enabled", "Posture on", choices=(False, True)),
    ),
    plots=(HAND, TILT, JOINT_3),
)

CHALLENGE = Challenge(
    text="Turn joint 3 by at least 25° while the hand stays within 1 mm.",
    goals=(
        Claim("Joint 3 turns by 25°.", Measure(JOINT_3, "range"), "at least", 25.0),
        Claim("The hand stays within 1 mm.", Measure(HAND), "at most", 1.0),
    ),
    knobs=(
        Control("tasks.position.K_p", "K_P of the position, 1/s²", 10.0, 400.0, log=True),
        Control("tasks.position.K_v", "K_V of the position, 1/s", 2.0, 60.0),
        Control("tasks.posture.K_p", "K_P of the posture, 1/s²", 1.0, 400.0, log=True),
        Control("M_bar_scale", "M̄, factor", 0.1, 10.0, log=True),
    ),
    score=Score(Measure(HAND), worst=1.0, best=0.2),
    solutions=(("M_bar_scale=4",), ("tasks.position.K_p=300", "tasks.position.K_v=35")),
    events=TURN_ELBOW,
    duration=2.5,
)

LESSON = Lesson(
    name="a-redundant-arm",
    card=card_of(__doc__),
    scene="iiwa14-hold",
    set=("avoidance.on=false",),
    steps=(FOLLOW, ELBOW, COUNT),
    challenge=CHALLENGE,
)

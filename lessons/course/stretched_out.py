"""Stretched out

A straight arm cannot move its hand further out: can its controller handle this pose?

Minutes: 8
You need: lesson "when-tasks-fight"; the rank of a matrix
"""

from __future__ import annotations

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

HAND = Signal("error/position", "mm")
TORQUE = Signal("torque share", "%")
CONTROLLER = Control("controller", "Controller", choices=("himpc", "osf", "osf_damped", "tdeosf", "hqp"))
SMOOTH = Control("smooth", "Start gently", choices=(False, True))

INVERSE = Step(
    title="The limit of reach",
    text=r"""
    The arm starts straight, and the circle starts sideways at the limit of the arm's reach. All three columns
    of $J$ are parallel there: no joint moves the hand along the arm, and $J M^{-1} J^\top$ loses its rank.
    Operational-space control needs $(J M^{-1} J^\top)^{-1}$.
    """,
    do="Start the circle gently. Then try OSF with a damped inverse, TDEOSF, HQP and HIMPC.",
    why=r"""
    A sideways motion alone needs almost no torque. But the path is curved: right after the start the circle
    demands 0.06 m/s² along the arm, where no joint can move the hand, and the inverse magnifies this
    acceleration many million times. With a gentle start the circle demands no acceleration along the arm at
    first, and for a tenth of a second the demanded torque is small. Then, at 0.13 s, the demand exceeds
    a thousand times the limit for one or two ticks. A damped inverse, `osf_damped`, demands a fifth of the
    limit. Real motors clip torques above their limit.
    """,
    prediction=Choice(
        "The hand should only move sideways. What is the largest torque that OSF demands?",
        (
            Option("as much as the motion needs, less than half of the limit", high=100.0),
            Option("a few times the limit", 100.0, 1e4),
            Option("more than a thousand times the limit", low=1e5),
        ),
        Measure(TORQUE),
        tempting=0,
    ),
    claims=(
        Claim(
            "The demand exceeds a thousand times the torque limit.",
            Measure(TORQUE),
            "at least",
            1e5,
            fails_with=("controller=himpc",),
            because="HIMPC with R = 10 demands at most half of the limit, even without bounds",
        ),
    ),
    set=("controller=osf",),
    duration=1.0,
    controls=(SMOOTH, CONTROLLER),
    plots=(TORQUE, HAND),
)

REGULAR = Step(
    title="A cost instead of an inverse",
    text=r"""
    HIMPC minimises $Q \lVert e \rVert^2 + R \lVert \Delta\tau \rVert^2$ over $\Delta\tau$. Where $J$ loses
    a direction, the first term does not depend on the torque in this direction, and the second term makes
    the change of this torque zero. The Hessian $\bar B^\top \bar Q \bar B + \bar R$ is positive definite
    for every $J$ (Lemma 1).
    """,
    do="Make R smaller by a factor of a million. Is the torque still small?",
    why=r"""
    The torque never leaves its bounds, and after a few tenths of a second the hand is on its circle,
    without a special case for singular poses. With its bounds HIMPC demands 67 % of the limit even with $R
    = 10^{-12}$. Without bounds $R$ keeps the torque small: with $R = 10^{-5}$ and no bounds HIMPC demands
    more than a hundred times the limit. $R$ is a damping factor, too. But $R$ damps the *change* of torque:
    at rest the cost of the change is zero, so $R$ need not be small for accuracy. The ghost, with a hundred
    times the $R$, is as accurate; with a million times the $R$ the hand swings by centimetres and more.
    """,
    claims=(
        Claim(
            "The demanded torque stays within its limit.",
            Measure(TORQUE),
            "at most",
            100.0,
            fails_with=("controller=tdeosf",),
            because="TDEOSF inverts a matrix that has no inverse",
        ),
        Claim(
            "From 1 s on the hand is within half a millimetre of its circle.",
            Measure(HAND, after=1.0),
            "at most",
            0.5,
            fails_with=("controller=hqp",),
            because="HQP also keeps control, but its model has no friction",
        ),
        Claim(
            "From 1 s on the error with R = 10 exceeds the error with R = 1000 by at most 10 %.",
            Measure(HAND, after=1.0, over_ghost=True),
            "at most",
            1.1,
            fails_with=("R=1e5",),
            because="then changes of torque cost so much that the hand follows late",
        ),
    ),
    duration=2.0,
    ghost=Ghost("R = 1000", ("R=1000",)),
    controls=(CONTROLLER, Control("R", "R of both levels", 1e-5, 100.0, log=True)),
    plots=(TORQUE, HAND),
)

BLAME = Step(
    title="The cause of the error",
    text=r"""
    The hand had an error of some millimetres right at the start. Does the singularity cause it, or the
    reference, which starts with a jump of its velocity to 0.08 m/s? Now the same circle starts gently, at
    the same singular pose. The ghost starts with the jump.
    """,
    do="Look at 8 s: the arm is straight again, and the second circle begins.",
    why=r"""
    Nearly all of the error was due to the jump. The size of this error is mostly due to the desired motion:
    (4) brings the hand back slowly. With four times the $K_P$ and twice the $K_V$ the error after the jump
    is 1.7 mm. In a singular pose HIMPC follows the reference in the directions in which the arm can move.
    Where an error has two possible causes at once, an experiment does not show which of them acts; so remove
    one of them.
    """,
    prediction=Choice(
        "With the same singular pose and a gentle start, the largest error becomes …",
        (
            Option("hardly smaller: the pose is the problem", low=0.7),
            Option("about half", 0.3, 0.7),
            Option("less than a third", high=0.3),
        ),
        Measure(HAND, over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "The largest error is at most a tenth of the ghost's.",
            Measure(HAND, over_ghost=True),
            "at most",
            0.1,
            fails_with=("smooth=false",),
            because="then both robots have the same settings",
        ),
        Claim(
            "The hand stays within half a millimetre.",
            Measure(HAND),
            "at most",
            0.5,
            fails_with=("controller=hqp",),
            because="HQP's model has no friction, whether the start is gentle or not",
        ),
    ),
    set=("smooth=true",),
    duration=2.0,
    ghost=Ghost("starts with a jump of velocity", ("smooth=false",)),
    controls=(SMOOTH, CONTROLLER),
    plots=(HAND, TORQUE),
)

LESSON = Lesson(
    name="stretched-out",
    card=card_of(__doc__),
    scene="planar3-singular",
    steps=(INVERSE, REGULAR, BLAME),
)

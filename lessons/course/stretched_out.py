"""Stretched out

A straight arm cannot push further out: does its controller know?

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
    title="The wall of reach",
    text=r"""
    The arm starts straight, and the circle starts sideways at the very edge of its reach. All three
    columns of $J$ are parallel there: no joint moves the hand along the arm, and $J M^{-1} J^\top$
    loses its rank. Operational-space control needs $(J M^{-1} J^\top)^{-1}$.
    """,
    do="Start gently. Then try OSF with a damped inverse, TDEOSF, HQP and HIMPC.",
    why=r"""
    Sideways almost no torque would be enough. But a circle also bends: right after the start this one
    asks for 0.06 m/s² along the arm, where no joint can move the hand, and the inverse magnifies that
    many million times. Started gently, the circle asks for nothing along the arm at first, and for a
    tenth of a second the demand is small. Then, at 0.13 s, it passes a thousand times the limit all the
    same, for a tick or two. A damped inverse, `osf_damped`, asks for a fifth of the limit. Motors
    cannot follow such demands: they clip them.
    """,
    prediction=Choice(
        "The hand should only move sideways. How much torque does OSF ask for, at most?",
        (
            Option("what the motion needs, less than half of the limit", high=100.0),
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
            because="HIMPC with R = 10 demands no more than half of the limit, even without bounds",
        ),
    ),
    set=("controller=osf",),
    duration=1.0,
    controls=(SMOOTH, CONTROLLER),
    plots=(TORQUE, HAND),
)

REGULAR = Step(
    title="A softer question",
    text=r"""
    HIMPC asks another question: which $\Delta\tau$ makes $Q \lVert e \rVert^2 + R \lVert
    \Delta\tau \rVert^2$ small? Where $J$ loses a direction, the first term does not depend on it, and
    the second makes the torque change zero there. The Hessian $\bar B^\top \bar Q \bar B + \bar R$ is
    positive definite whatever $J$ is (Lemma 1).
    """,
    do="Make R smaller by a factor of a million. Is it still calm?",
    why=r"""
    The torque never leaves its bounds, and after a few tenths of a second the hand is on its circle,
    with no case distinction for singular poses. With its bounds HIMPC demands 67 % of the limit even
    with $R = 10^{-12}$. Without bounds $R$ keeps it calm: with $R = 10^{-5}$ it then demands more than
    a hundred times the limit. $R$ is a damping factor, too. But it damps the *change* of torque: at
    rest it costs nothing, so it need not be small to be accurate. The ghost, with a hundred times the
    $R$, does as well; with a million times the hand swings by centimetres and more.
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
            because="HQP keeps control as well, but its model has no friction",
        ),
        Claim(
            "From 1 s on it is as near with R = 10 as with R = 1000, within 10 %.",
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
    title="Who is to blame?",
    text=r"""
    There was an error of some millimetres right at the start. Is the singularity the cause, or the
    reference, which starts with a jump of its velocity to 0.08 m/s? Now the same circle starts gently,
    at the same singular pose. The ghost starts with the jump.
    """,
    do="Look at 8 s: straight again, and the circles change there.",
    why=r"""
    Nearly all of it was the jump. How far the hand then gets off is mostly decided by (4), which brings
    it back slowly. With four times the $K_P$ and twice the $K_V$ the jump costs 1.7 mm. In a singular
    pose HIMPC follows what can be followed. Where an experiment has two possible causes at once, it
    does not show which one acts; so take one of them away.
    """,
    prediction=Choice(
        "Same singular pose, gentle start. The largest error becomes …",
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
            because="its model has no friction, whether the start is gentle or not",
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

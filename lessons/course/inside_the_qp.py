"""Inside the QP

One millisecond on a sheet of paper: what is asked for, what is left, and who feels which bound?

Minutes: 15
You need: lesson "torque-has-a-limit"; ellipses as the contours of a quadratic function
"""

from __future__ import annotations

from lessons.events import MoveLevel, MoveTarget
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

WRIST = Signal("error/reach", "mm")
JOINTS = Signal("error/pose", "deg")
TORQUE = Signal("torque share", "%")
ACTIVE_1, ACTIVE_2 = Signal("active/reach"), Signal("active/pose")
LEAK, TRUE_LEAK = Signal("priority_leak", "m/s²"), Signal("dynamic_leak", "m/s²")
ASIDE = (0.1, MoveTarget("reach", (0.33,)))  # by 10 cm
SCALE = Control("limits.torque_scale", "Torque limit, factor", 0.01, 1.0, log=True)
WEIGHT = Control("levels.reach.Q", "Q of level 1", 1.0, 1000.0, log=True)
CONTROLLER = Control("controller", "Controller", choices=("himpc", "weighted", "osf"))

LINE = Step(
    title="A valley and a line",
    text=r"""
    The picture *Inside* is one tick. With $N = 1$ the unknowns are three torque changes; joint 3
    only holds its own angle, so all the rest happens in the plane of $\Delta\tau_1$ and
    $\Delta\tau_2$. The red frame holds the bounds: nothing outside can be asked for.

    **Level 1** (orange) wants *one* number, the wrist's $x$. One equation for two unknowns: its
    cost (31) is a long valley, and its optimum the disc 1 ($R$ picks the one nearest to no change
    at all). **(33)** says: whatever comes below must not touch this. What it leaves is the orange
    line. **Level 2** (blue) wants both joints to stay where they are. At 0.1 s the wrist's target
    moves aside by 10 cm.
    """,
    do="Drag the target to and fro: line, valley and both discs move along. Pause, and go tick by tick (T).",
    why=r"""
    Blue would like to be at the ring "2 alone", the middle of its ellipses. It may only choose on
    the line, and takes the point where one of its ellipses just touches it. The wrist arrives, and the
    joints stay 14 degrees off: on the line there is no better point by the weights of level 2, which
    count joint 1 four times as much as joint 2. With equal weights they stay 12 degrees off. At rest
    both discs lie at zero, "leave the torque as it is", and the ring stays outside.
    """,
    prediction=Choice(
        "The wrist goes 10 cm aside, and both joints want to stay. In the end the joints are off by …",
        (
            Option("nothing: three joints are enough for all", high=1.0),
            Option("10° to 20°, and the wrist is on its target", 10.0, 20.0),
            Option("half of that: the wrist and the joints share the loss", 5.0, 10.0),
        ),
        Measure(JOINTS, "last"),
        tempting=2,
    ),
    claims=(
        Claim(
            "Level 1 gets what it asks for: in the end less than 0.01 mm is missing.",
            Measure(WRIST, after=1.9),
            "at most",
            0.01,
            fails_with=("controller=weighted",),
            because="one cost for all has no line, only a compromise",
        ),
        Claim(
            "Level 2 is more than 10° away from what it wants.",
            Measure(JOINTS, "last"),
            "at least",
            10.0,
            fails_with=("order=pose,reach,wrist",),
            because="then it has the higher priority",
        ),
    ),
    events=(ASIDE,),
    controls=(WEIGHT, CONTROLLER),
    plots=(WRIST, JOINTS),
)

SWAP = Step(
    title="Swap the levels",
    text=r"""
    The same again, but at 1.2 s the two levels change places: blue becomes level 1. It wants *two*
    numbers, so look at what (33) can leave of a plane then.
    """,
    do="Swap them back and forth while you watch the line come and go.",
    why=r"""
    Two equations for two unknowns leave a point. The line is gone, disc 1 sits in the middle of the
    blue ellipses, and the orange valley has to take what is there: the wrist goes all the way back,
    10 cm off its target, though it is *wanted* as much as before. Same costs, same numbers, another
    order: only the roles have changed.
    """,
    prediction=Choice(
        "The wrist is on its target when its level becomes the second. A second later it is …",
        (
            Option("still there: nobody has moved the target", high=10.0),
            Option("half way back", 10.0, 80.0),
            Option("back where it began, 10 cm off", low=80.0),
        ),
        Measure(WRIST, after=2.2),
        tempting=0,
    ),
    claims=(
        Claim(
            "The joints return to their angles: less than 0.2° is missing in the end.",
            Measure(JOINTS, "last"),
            "at most",
            0.2,
            fails_with=("controller=weighted",),
            because="in a weighted sum the order of the levels has no effect",
        ),
        Claim(
            "The wrist ends more than 90 mm from its target.",
            Measure(WRIST, after=2.3),
            "at least",
            90.0,
            fails_with=("controller=weighted",),
            because="there the wrist keeps half of its way",
        ),
    ),
    events=(ASIDE, (1.2, MoveLevel("pose", 0))),
    duration=2.6,
    controls=(Control("order", "Order", choices=("reach,pose,wrist", "pose,reach,wrist")),),
    plots=(WRIST, JOINTS),
)

BOUND = Step(
    title="A torque bound cuts",
    text=r"""
    Now the motors give a quarter of their torque. At every tick $\Delta\tau$ may only be what is
    left up to the limit, so a side of the red frame says *torque* and comes close to zero while the
    arm speeds up. The box cuts the line: what is left of it is the thick part.

    The red triangle is what OSF would ask for in the same tick: projection instead of (33), the
    same order of tasks, no bounds at all. The ghost is OSF, and *its* motors give whatever is asked.
    """,
    do="Make the torque scarcer, to 0.1: from when on does the disc 1 hit the frame, too?",
    why=r"""
    Level 1 moves along its valley, where other points are as good, and loses nothing: its error is
    no larger than with all the torque. Level 2 slides along the line until the frame stops it, short
    of the point where its ellipse would touch. Such a bound is *active*. With a little more room this
    level's cost (31) would fall by twice the bound's multiplier, per N·m. With a tenth of the torque
    the whole valley is outside for a while: then level 1 pays as well.

    A projection splits torques by priority; that a torque must also be *possible* is no part of it:
    the triangle leaves the box, here by a third of the limit. A real motor would clip its torque joint
    by joint, and the clipped torques no longer lie on the orange line: they change what level 1 decided.
    """,
    prediction=Choice(
        "With all of the torque the wrist is never more than 1.1 mm off. With a quarter of it …",
        (
            Option("more than 3 mm: it needs the torque most", low=3.0),
            Option("a little more, 1.5 to 3 mm", 1.5, 3.0),
            Option("the same", high=1.5),
        ),
        Measure(WRIST),
        tempting=0,
    ),
    claims=(
        Claim(
            "The wrist's error stays below 1.5 mm.",
            Measure(WRIST),
            "at most",
            1.5,
            fails_with=("limits.torque_scale=0.1",),
            because="then the torque is not enough even for level 1",
        ),
        Claim(
            "At some tick a bound is active at level 2.",
            Measure(ACTIVE_2),
            "at least",
            1.0,
            fails_with=("limits.torque_scale=1",),
            because="then the torque is never at its bound",
        ),
        Claim(
            "No more than the limit is ever asked for.",
            Measure(TORQUE),
            "at most",
            100.001,
            fails_with=("controller=osf",),
            because="OSF does not use the bounds",
        ),
    ),
    set=("limits.torque_scale=0.25",),
    events=(ASIDE,),
    duration=1.5,
    ghost=Ghost("OSF, which does not use bounds", ("controller=osf",)),
    controls=(SCALE,),
    plots=(WRIST, ACTIVE_1, ACTIVE_2, TORQUE),
)

SUM = Step(
    title="One cost for all",
    text=r"""
    The violet diamond is the optimum of *one* cost, the sum of all levels': no line, no order. The
    ghost moves that way. How strict the line is can be measured: the leak is what lower levels
    change about a higher one, $\lVert J_p \bar M^{-1} (\Delta\tau_i - \Delta\tau_p) \rVert$, in
    m/s². By (33) it should be zero.
    """,
    do="Give level 1 a larger Q, and watch the diamond come nearer to the line; it never gets there.",
    why=r"""
    The diamond lies between the valley and the ring, where the slopes of the two costs cancel. In the
    end the wrist is left 5 cm short of its 10 cm, and the joints give 7 degrees of the 14 that a strict
    order costs them: half of each. The disc 2 never leaves the line: nothing leaks, up to rounding.
    It is the line of $\bar M$, though. With the true $M$ a leak remains, which the second meter shows:
    $\bar M$ is not the arm's true inertia. Time-delay estimation notices it at the next tick and
    corrects it over tens of ticks.
    """,
    prediction=Choice(
        "With the arm's true inertia instead of M̄, the leak of the same torques is …",
        (
            Option("zero as well: priorities are exact", high=1e-9),
            Option("not zero", low=1e-4),
        ),
        Measure(TRUE_LEAK),
        tempting=0,
    ),
    claims=(
        Claim(
            "Strict priorities cost the joints more than 1.5 times as much.",
            Measure(JOINTS, "last", over_ghost=True),
            "at least",
            1.5,
            fails_with=("controller=weighted",),
            because="then both robots have the same settings",
        ),
        Claim(
            "In the controller's own terms nothing leaks: less than 10⁻⁹ m/s².",
            Measure(LEAK),
            "at most",
            1e-9,
            fails_with=("controller=weighted",),
            because="in a weighted sum every task changes the results of all others",
        ),
        Claim(
            "In the arm's terms there is a leak, more than 10⁻³ m/s².",
            Measure(TRUE_LEAK),
            "at least",
            1e-3,
            fails_with=("controller=osf", "nominal.armature=[0.05,0.05,0.03]"),
            because="OSF with the arm's exact inertia projects with the true M",
        ),
        Claim(
            "Of what leaks, more than 85 % are left a millisecond later.",
            Measure(Signal("gauge_radius"), "mean"),
            "at least",
            0.85,
            fails_with=("M_bar_scale=2",),
            because="twice the M̄ corrects twice as fast",
        ),
    ),
    events=(ASIDE,),
    duration=2.0,
    ghost=Ghost("weighted: one cost for all", ("controller=weighted",)),
    controls=(WEIGHT, CONTROLLER),
    plots=(LEAK, TRUE_LEAK, WRIST, JOINTS),
)

LESSON = Lesson(
    name="inside-the-qp",
    card=card_of(__doc__),
    scene="planar3-plane",
    steps=(LINE, SWAP, BOUND, SUM),
)

"""Inside the QP

In one millisecond, what does each level require, what is left, and which bounds are active?

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
    title="Two levels in one plane",
    text=r"""
    The picture *Inside* shows one tick. With $N = 1$ the unknowns are three torque changes; joint 3 only
    holds its own angle, so the picture shows the plane of $\Delta\tau_1$ and $\Delta\tau_2$. The red frame
    shows the bounds: no torque change outside the frame is allowed.

    **Level 1** (orange) has a target for *one* number, the wrist's $x$. This gives one equation for two
    unknowns: the cost (31) is a long valley, and disc 1 is its optimum (of all points in the valley, $R$
    selects the point with the smallest change). **(33)** requires that the levels below keep this result.
    The points that (33) allows form the orange line. **Level 2** (blue) has the task to keep both joints
    where they are. At 0.1 s the wrist's target moves aside by 10 cm.
    """,
    do=("Drag the target to and fro, and watch line, valley and discs. Pause, and step tick by tick (T)."),
    why=r"""
    The optimum of level 2 by itself is the ring "2 alone", the centre of its ellipses. Level 2 may choose
    only points on the line, and takes the point where one of its ellipses touches the line. The wrist
    reaches its target, and level 2 keeps an error of 14 degrees. By the weights of level 2, which count
    joint 1 four times as much as joint 2, the line contains no better point. With equal weights the error
    is 12 degrees. At rest both discs lie at zero, which means no change of torque, and the ring lies off
    the line.
    """,
    prediction=Choice(
        "The wrist goes 10 cm aside, and both joints should stay. In the end the joints are off by …",
        (
            Option("nothing: three joints are enough for all", high=1.0),
            Option("10° to 20°, and the wrist is on its target", 10.0, 20.0),
            Option("half as much: the wrist and the joints share the error", 5.0, 10.0),
        ),
        Measure(JOINTS, "last"),
        tempting=2,
    ),
    claims=(
        Claim(
            "Level 1 reaches its target: the final error is less than 0.01 mm.",
            Measure(WRIST, after=1.9),
            "at most",
            0.01,
            fails_with=("controller=weighted",),
            because="one cost for all tasks gives only a compromise",
        ),
        Claim(
            "The joints of level 2 are more than 10° away from their targets.",
            Measure(JOINTS, "last"),
            "at least",
            10.0,
            fails_with=("order=pose,reach,wrist",),
            because="then this level has the higher priority",
        ),
    ),
    events=(ASIDE,),
    controls=(WEIGHT, CONTROLLER),
    plots=(WRIST, JOINTS),
)

SWAP = Step(
    title="Swap the levels",
    text=r"""
    The start is the same, but at 1.2 s the order of the two levels is reversed: the blue level becomes
    level 1. It has targets for *two* numbers, so look at the part of the plane that (33) then allows.
    """,
    do="Swap the levels back and forth, and watch the line appear and disappear.",
    why=r"""
    Two equations for two unknowns leave one point. The line is gone, disc 1 lies in the middle of the blue
    ellipses, and the orange level must use this point: the wrist goes all the way back, 10 cm off its
    target, although its task has the same weight as before. The costs and the numbers are the same, and
    only the order has changed.
    """,
    prediction=Choice(
        "The wrist is on its target when its level becomes level 2. After 1 s the wrist is …",
        (
            Option("still on its target: the target has not moved", high=10.0),
            Option("half way back", 10.0, 80.0),
            Option("back where it began, 10 cm off", low=80.0),
        ),
        Measure(WRIST, after=2.2),
        tempting=0,
    ),
    claims=(
        Claim(
            "The joints return to their angles: the final error is less than 0.2°.",
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
            because="in a weighted sum the wrist keeps half of its way",
        ),
    ),
    events=(ASIDE, (1.2, MoveLevel("pose", 0))),
    duration=2.6,
    controls=(Control("order", "Order", choices=("reach,pose,wrist", "pose,reach,wrist")),),
    plots=(WRIST, JOINTS),
)

BOUND = Step(
    title="A torque bound",
    text=r"""
    Now the motors give a quarter of their torque. At every tick $\Delta\tau$ is limited by the distance
    from the torque to its limit, so one side of the red frame has the label *torque* and comes close to
    zero while the arm speeds up. The frame cuts the line: the thick part is inside the frame.

    The red triangle is the torque change that OSF demands in the same tick. OSF uses the same order of
    tasks, a projection instead of (33), and no bounds. The ghost is OSF with motors that give any torque.
    """,
    do="Reduce the torque further, to 0.1. At what time does disc 1 reach the frame, too?",
    why=r"""
    Level 1 moves along its valley, where other points are as good, and its error is no larger than with the
    full torque. Level 2 moves along the line only to the frame, before the point where its ellipse touches
    the line. Such a bound is *active*. If the bound were a little wider, the cost (31) of level 2 would
    fall by twice the bound's multiplier, per N·m. With a tenth of the torque the whole valley is outside
    the frame for a while: then the error of level 1 grows as well.

    A projection separates torques by priority, but it contains no bounds: the triangle leaves the frame,
    here by a third of the limit. Real motors would clip their torques joint by joint. The clipped torques
    would no longer lie on the orange line, and would change the result of level 1.
    """,
    prediction=Choice(
        "With the full torque the wrist is never more than 1.1 mm off. With a quarter of the torque …",
        (
            Option("more than 3 mm: the wrist needs the torque most", low=3.0),
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
            "A bound is active at level 2 in at least one tick.",
            Measure(ACTIVE_2),
            "at least",
            1.0,
            fails_with=("limits.torque_scale=1",),
            because="then the torque is never at its bound",
        ),
        Claim(
            "The demanded torque never exceeds the limit.",
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
    The violet diamond is the optimum of *one* cost, the sum of the costs of all levels, without a line and
    without an order. The ghost uses this sum. The strictness of the order can be measured: the leak is the
    effect of lower levels on a higher level, $\lVert J_p \bar M^{-1} (\Delta\tau_i - \Delta\tau_p) \rVert$,
    in m/s². By (33) the leak should be zero.
    """,
    do="Give level 1 a larger Q, and watch the diamond come nearer to the line; it never reaches the line.",
    why=r"""
    The diamond lies between the valley and the ring, where the slopes of the two costs cancel. In the end
    the wrist is 5 cm from its target, which was 10 cm away at the start, and the joints are off by 7
    degrees instead of 14 with a strict order: each task is half done. The disc 2 never leaves the line: the
    leak is zero, up to rounding. But this line is computed with $\bar M$, which is not the arm's true
    inertia. With the true $M$ a leak remains, and the second meter shows this leak. Time-delay estimation
    measures the leak at the next tick and corrects it over tens of ticks.
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
            "With strict priorities the error of the joints is more than 1.5 times the ghost's.",
            Measure(JOINTS, "last", over_ghost=True),
            "at least",
            1.5,
            fails_with=("controller=weighted",),
            because="then both robots have the same settings",
        ),
        Claim(
            "In the model of the controller the leak is less than 10⁻⁹ m/s².",
            Measure(LEAK),
            "at most",
            1e-9,
            fails_with=("controller=weighted",),
            because="in a weighted sum every task changes the results of all others",
        ),
        Claim(
            "With the inertia of the arm the leak is more than 10⁻³ m/s².",
            Measure(TRUE_LEAK),
            "at least",
            1e-3,
            fails_with=("controller=osf", "nominal.armature=[0.05,0.05,0.03]"),
            because="OSF with the arm's exact inertia projects with the true M",
        ),
        Claim(
            "More than 85 % of the leak are left a millisecond later.",
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

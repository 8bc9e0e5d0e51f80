"""Seeing ahead

A robot must go away and come back after eight seconds: what is the advantage of knowing this in advance?

Minutes: 12
You need: lesson "first-hold-then-reach"
"""

from __future__ import annotations

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/ee", "mm")
BASE = Signal("error/base", "m")
WAY = Signal("way of the base", "m")
BACK = Measure(BASE, "mean", after=8.0, over_ghost=True)
CONTROLLER = Control("controller", "Controller", choices=("htmpc", "htmpc_wpt", "htidkc"))
HORIZON = Control("horizon", "N", 1, 20)
PLOTS = (BASE, HAND, WAY)
PAIRS = ([0.5, 0.3], [1, 1], [2, 2], [5, 2], [20, 2])

EARLY = Step(
    title="The base leaves before the jump",
    text=r"""
    The hand holds its place. The reference of the base is a square wave: from 0 to 8 s a peak that the base
    cannot reach (Part 1), from 8 to 16 s its home (Part 2). Every plan covers the next $N \Delta t = 1$ s,
    and the cost (8) uses the reference of each knot, $e_k = f(q_k) - r(t + k \Delta t)$: half a second
    before the jump the references of six of ten knots are already at home. The ghost is the same
    controller, but it receives two separate waypoints, one after the other, and has no information about
    the second waypoint before it is due.
    """,
    do="Raise N from 1 to 20. When does the base leave?",
    why=r"""
    The base has already driven more than half a metre of the way back at 8 s. A base that leaves early has
    a larger error at the end of Part 1 and a smaller one at the beginning of Part 2. Summed over all knots
    of the plan, leaving early is cheaper. The mean error of Part 2 is about a quarter of the ghost's. The
    hand stays in place with and without preview in level 2: (12) holds in both cases.
    """,
    prediction=Choice(
        "The reference jumps at 8 s. How much of the way back does the base drive before 8 s?",
        (
            Option("nothing: until 8 s the reference stays at the peak", high=0.05),
            Option("some centimetres", 0.05, 0.3),
            Option("about half a metre", low=0.3),
        ),
        Measure(WAY, "range", after=6.5, until=8.0),
        tempting=0,
    ),
    claims=(
        Claim(
            "Between 6.5 s and 8 s the base drives at least 40 cm.",
            Measure(WAY, "range", after=6.5, until=8.0),
            "at least",
            0.4,
            fails_with=("controller=htmpc_wpt",),
            because="without preview the controller receives the next place only at 8 s",
        ),
        Claim(
            "In Part 2 the base's mean error is at most half the ghost's.",
            BACK,
            "at most",
            0.5,
            fails_with=("controller=htmpc_wpt",),
            because="then both robots have the same settings",
        ),
    ),
    duration=16.0,
    ghost=Ghost("waypoints, no preview", ("controller=htmpc_wpt",)),
    controls=(CONTROLLER, HORIZON),
    plots=PLOTS,
)

SHORT = Step(
    title="A fifth of a second",
    text=r"""
    How long must the horizon be? Now $N = 2$: the plan ends after 0.2 s. Along each of its two axes the
    base still brakes with at most 2.5 m/s², and its acceleration changes by at most 10 m/s³: the change
    from zero to the largest braking takes 0.25 s. Along each axis the top speed is 1.1 m/s. A stop from
    this speed takes at least 0.44 s.
    """,
    do="From which N on is the hand within 1 mm? Compare this horizon with the time the base needs to stop.",
    why=r"""
    The hand ranks first, but is off by 3 cm. On its way home the base drives at its top speed along both
    axes. The hand needs a slower base, but this need appears in the plan too late: the acceleration of the
    base can no longer change fast enough. Without the bound on this change, the hand is off by 6 mm with the
    same horizon of 0.2 s. With this bound and half the top speed, it is off by 4 mm. A limit of the
    acceleration that is three times as high hardly helps. A priority selects the best plan within the
    horizon; it cannot prepare for events beyond the horizon.
    """,
    prediction=Choice(
        "With N = 2 instead of 10, the hand still ranks first. The hand is off by at most …",
        (
            Option("less than 1 mm, as before: the hand ranks first", high=1.5),
            Option("some millimetres", 1.5, 10.0),
            Option("centimetres", low=10.0),
        ),
        Measure(HAND),
        tempting=0,
    ),
    claims=(
        Claim(
            "The hand is off by more than 1 cm.",
            Measure(HAND),
            "at least",
            10.0,
            fails_with=("horizon=10",),
            because="ten knots over a second are enough to slow down in time",
        ),
    ),
    set=("horizon=2",),
    duration=16.0,
    ghost=Ghost("N = 10", ("horizon=10",)),
    controls=(HORIZON, Control("limits.jerk", "Bound on the change of acceleration", choices=(False, True))),
    plots=PLOTS,
)

NO_PLAN = Step(
    title="Without any plan",
    text=r"""
    The paper compares HTMPC with HTIDKC. HTIDKC is inverse kinematics with priorities: it computes a
    desired velocity for every point,

    $$\dot x = \dot r + K (r - x)$$

    and solves one quadratic program per level, with bounds, fifty times a second. $K = 0.5$ 1/s for the
    hand and $0.3$ 1/s for the base are the authors' values. HTIDKC uses the present instant only. The ghost
    plans a second ahead, but from waypoints: neither of the two has information about the jump.
    """,
    do="Compare the two speeds: which robot is faster right after a jump, and which shortly before the goal?",
    why=r"""
    Neither of the two knows the new reference before 8 s, but HTIDKC is much slower: it is 16 cm from home
    at the end, when the ghost has long arrived. A velocity in proportion to the error is small at the end,
    and with 0.3 1/s it is small for a long time. Even without any limit on speed and acceleration HTIDKC is
    hardly nearer home at the end. But with a gain of 2 1/s it arrives. A planner has weights instead of a
    gain. With our $Q = 10$ it is nearly as quick as the limits allow: with half the speed limit, or a third
    of the acceleration, it comes home later. These limits do not slow HTIDKC down: it never drives faster
    than half the limit, and comes home as late as before. With $Q = 1$ and the scene's own limits the planner
    is still 22 cm away at the time when it is home with $Q = 10$. In the paper both methods were tuned to
    have equal errors in Part 1, and in Part 2 the error of HTMPC is 42 % smaller.
    """,
    prediction=Value(
        "In Part 2, the mean error of the base with HTIDKC is how many times the ghost's?",
        BACK,
        low=0.3,
        high=30.0,
        factor=1.5,
    ),
    claims=(
        Claim(
            "In Part 2 the base's mean error is at least twice the ghost's.",
            BACK,
            "at least",
            2.0,
            fails_with=("controller=htmpc",),
            because="HTMPC with preview is better than the ghost",
        ),
        Claim(
            "The hand is off by more than 3 mm.",
            Measure(HAND),
            "at least",
            3.0,
            fails_with=("controller=htmpc_wpt",),
            because="the plan keeps the hand within a millimetre, with the same information about the jump",
        ),
    ),
    set=("controller=htidkc",),
    duration=16.0,
    ghost=Ghost("HTMPC from waypoints", ("controller=htmpc_wpt",)),
    controls=(CONTROLLER,),
    plots=PLOTS,
)

GAINS = Step(
    title="Higher gains",
    text=r"""
    Do higher gains make HTIDKC faster? Now $K = 2$ 1/s for both. The ghost keeps the authors' 0.5 and 0.3.
    """,
    do="Is there a pair of gains that is good for both hand and base? Try [5, 2] and [20, 2].",
    why=r"""
    The base is quick now, and the hand is off by 2 cm although it ranks first. A velocity is held for 20
    ms, until the next velocity is computed. Meanwhile base and arm move, and velocities that kept the hand
    in place at the beginning do not keep it there any more: the faster base and arm move, the further the
    hand drifts. It drifts most at the edge of the arm's reach, 20 mm, where the arm's joints turn fastest.
    It drifts nearly as far on the way home, 16 mm, where the base is at full speed. With a peak that the
    arm can just reach the hand is off by 14 mm, with a near peak by 4 mm. If velocities are computed a
    hundred times a second, the hand drifts half as far. With two hundred velocities a second the hand is off
    by 8 mm, not 5: on the way home a part of the error is due to the limits on acceleration and its change,
    and does not shrink with the period. Without these limits 4.5 mm are left. The hand returns with a
    velocity in proportion to $K$: with 5 1/s for the hand its error is half as large, with 20 1/s it is 3 mm,
    and the base is as quick as before. Some limits increase the error, others reduce it: without the limits
    on acceleration and its change the hand is off by 18.5 mm, without the limits on speed by 28 mm, without
    any limits by 37 mm. A good pair exists, but it must be found. The paper says (given, not tried here) that
    HTIDKC needs different parameters in the two parts, whereas one set of weights is enough for HTMPC.
    """,
    prediction=Choice(
        "The gains are four and seven times as high. The largest error of the hand, the first task, …",
        (
            Option("shrinks: its gain is four times as high", high=0.9),
            Option("stays about the same", 0.9, 1.5),
            Option("grows severalfold", low=1.5),
        ),
        Measure(HAND, over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "In Part 2 the base's mean error is at most half of the ghost's.",
            BACK,
            "at most",
            0.5,
            fails_with=("gains=[0.5,0.3]",),
            because="then both robots have the same settings",
        ),
        Claim(
            "The hand is off by more than 1 cm.",
            Measure(HAND),
            "at least",
            10.0,
            fails_with=("gains=[0.5,0.3]",),
            because="in 20 ms a slow base and arm move the hand less far",
        ),
    ),
    set=("controller=htidkc", "gains=[2,2]"),
    duration=16.0,
    ghost=Ghost("gains 0.5 and 0.3", ("gains=[0.5,0.3]",)),
    controls=(Control("gains", "Gains of hand and base, 1/s", choices=PAIRS),),
    plots=PLOTS,
)

LESSON = Lesson(
    name="seeing-ahead",
    card=card_of(__doc__),
    scene="ridgeback-ur10-square",
    steps=(EARLY, SHORT, NO_PLAN, GAINS),
)

"""First hold, then reach

A robot on wheels holds something in place and is sent elsewhere: how far does it go?

Minutes: 10
You need: lesson "two-tasks"
"""

from __future__ import annotations

from lessons.events import MoveLevel, MoveTarget
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/ee", "mm")
HAND_M = Signal("error/ee", "m")
BASE = Signal("error/base", "m")
STRETCHED = Signal("manipulability")
NEAR = ((0.0, MoveTarget("base", (0.5, 0.4))),)
FAR = ((0.0, MoveTarget("base", (-2.0, 0.0))),)
ORDER = Control("order", "Which comes first", choices=("ee,base", "base,ee"))
AHEAD = Control("horizon", "N", 1, 20)
PLOTS = (HAND, BASE, STRETCHED)
BASE_FIRST = ("order=base,ee",)

BOTH = Step(
    title="Nine joints, two tasks",
    text=r"""
    The base rolls in every direction and turns, and carries an arm of six joints. In task $\mathcal T_1$
    the hand stays where it is (three coordinates). In task $\mathcal T_2$ the base drives to a place 64 cm
    away (two coordinates). The tasks use five of nine coordinates, which should leave enough freedom for
    both. Ten times a second the controller plans the accelerations of the next second, at $N = 10$ knots
    with a distance of $\Delta t = 0.1$ s. The cost of each task is a sum over the knots, with the errors $e
    = f(q) - r$ of the task:

    $$\mathcal J_l = \tfrac12 \Big( \sum_{k=0}^{N-1} \lVert e_k \rVert_{Q_k}^2 + \lVert e_N
    \rVert_P^2 \Big) \quad (8) \qquad \mathrm{lex\,min} \; [\mathcal J_1, \mathcal J_2] \quad (7a)$$

    *Lex min* is the lexicographic minimum, as in the order of words in a dictionary: first the smallest
    $\mathcal J_1$, and then the smallest $\mathcal J_2$ among the plans that have the smallest $\mathcal
    J_1$.
    """,
    do="Drag the base's target around the hand. On which side is the base furthest from the hand?",
    why=r"""
    The hand is off by hundredths of a millimetre. The base drives off, and the arm compensates at every
    instant for the motion of the base. With the base first (the ghost) both tasks also reach their goals,
    but on the way the hand swings out by 12 cm. Even where all tasks reach their goals, priorities decide
    which task may have an error on the way.
    """,
    prediction=Choice(
        "The base drives 64 cm, and the hand must not move. The largest error of the hand is …",
        (
            Option("less than a millimetre", high=1.0),
            Option("about a centimetre", 1.0, 50.0),
            Option("more than 5 cm, then it comes back", low=50.0),
        ),
        Measure(HAND),
        tempting=1,
    ),
    claims=(
        Claim(
            "The hand stays within 1 mm all the time.",
            Measure(HAND),
            "at most",
            1.0,
            fails_with=BASE_FIRST,
            because="then the hand has the lower priority",
        ),
        Claim(
            "From 5 s on the base is within 1 cm of its place.",
            Measure(BASE, "mean", after=5.0),
            "at most",
            0.01,
            fails_with=("controller=stmpc",),
            because="single-task MPC uses the first task only",
        ),
    ),
    events=NEAR,
    duration=6.0,
    ghost=Ghost("base first", BASE_FIRST),
    controls=(ORDER, AHEAD),
    plots=PLOTS,
)

REACH = Step(
    title="Out of reach",
    text=r"""
    The hand stays where it is, and now the base is sent to a place 3.5 m away from the hand. The arm
    reaches 1.86 m. The second task cannot be done, so what is the best plan? Level 2 minimises $\mathcal
    J_2$ and must not make any error of level 1 larger than its best value,

    $$|e_{kp}| \le |e_{kp}|^*, \quad k = 0, \ldots, N \quad (12)$$

    at every knot $k$ and in each coordinate $p$.
    """,
    do="Drag the base's target around in a circle. Which path does the base follow on the floor?",
    why=r"""
    The base stops exactly where the arm is stretched, 1.63 m before its target, and the hand stays in its
    place. The program contains no rule for this place of the base. Here every plan that makes $\mathcal
    J_2$ smaller also changes $\mathcal J_1$. The arm is singular: its manipulability $w = \sqrt{\det J
    J^\top}$ is almost zero.
    """,
    prediction=Choice(
        "The base's target cannot be reached while the hand stays. What happens to the hand?",
        (
            Option("it moves by some centimetres, a compromise", low=10.0),
            Option("it vibrates within a centimetre at the limit of the arm's reach", 1.0, 10.0),
            Option("nothing", high=1.0),
        ),
        Measure(HAND),
        tempting=0,
    ),
    claims=(
        Claim(
            "The hand stays within 1 mm.",
            Measure(HAND),
            "at most",
            1.0,
            fails_with=BASE_FIRST,
            because="the base drives on and moves the hand as well",
        ),
        Claim(
            "The base stops more than 1.5 m before its target.",
            Measure(BASE, "mean", after=7.0),
            "at least",
            1.5,
            fails_with=BASE_FIRST,
            because="then no task of higher priority holds the base back",
        ),
        Claim(
            "The arm is stretched: w falls below 0.01.",
            Measure(STRETCHED, "mean", after=7.0),
            "at most",
            0.01,
            fails_with=("levels.base.enabled=false",),
            because="if the base does not move away, the arm does not stretch",
        ),
    ),
    events=FAR,
    duration=8.0,
    ghost=Ghost("base first", BASE_FIRST),
    controls=(ORDER, AHEAD),
    plots=PLOTS,
)

SWAP = Step(
    title="Reverse the order",
    text=r"""
    The start is the same, and at 4 s, when the arm is stretched, the order of the two tasks is reversed.
    Now $\mathcal T_1$ is the task of the base and $\mathcal T_2$ that of the hand: (12) protects the base.
    """,
    do="Swap the tasks once more while the base is on its way. Does the hand return?",
    why=r"""
    The base drives the missing 1.63 m, and the hand is left behind by exactly these 1.63 m. The conflict is
    as large as before, but now the hand has the error. In a hierarchy the last task in the list has the
    error.
    """,
    prediction=Value(
        "The base now reaches its target. How large is the error of the hand in the end, in m?",
        Measure(HAND_M, "mean", after=8.5),
        low=0.05,
        high=5.0,
        factor=1.3,
    ),
    claims=(
        Claim(
            "Before the swap the hand is within 1 mm.",
            Measure(HAND, until=4.0),
            "at most",
            1.0,
            fails_with=BASE_FIRST,
            because="then the base ranks first from the beginning",
        ),
        Claim(
            "4.5 s after the swap the base is at its target.",
            Measure(BASE, "mean", after=8.5),
            "at most",
            0.01,
            fails_with=("limits.velocity_scale=0.2",),
            because="at a fifth of the speed the base is still on its way",
        ),
        Claim(
            "The error of the hand is then more than 1.5 m.",
            Measure(HAND_M, "mean", after=8.5),
            "at least",
            1.5,
            fails_with=("levels.base.enabled=false",),
            because="without a second task there is no conflict",
        ),
    ),
    events=(*FAR, (4.0, MoveLevel("base", 0))),
    duration=9.0,
    controls=(Control("limits.velocity_scale", "Speed limits, factor", 0.1, 1.0), AHEAD),
    plots=(BASE, HAND_M, STRETCHED),
)

LESSON = Lesson(
    name="first-hold-then-reach",
    card=card_of(__doc__),
    scene="ridgeback-ur10-drag",
    steps=(BOTH, REACH, SWAP),
)

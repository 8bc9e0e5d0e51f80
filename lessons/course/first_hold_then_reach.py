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
    title="Nine joints, two wishes",
    text=r"""
    A base that rolls in every direction and turns, and on it an arm of six joints. Task
    $\mathcal T_1$: the hand stays where it is, three coordinates. Task $\mathcal T_2$: the base
    drives to a place 64 cm away, two coordinates. Five of nine: there should be enough freedom for
    both. Ten times a second the controller plans the accelerations of the next second, $N = 10$
    knots $\Delta t = 0.1$ s apart, and each task has a cost of its own, the errors $e = f(q) - r$
    summed over them:

    $$\mathcal J_l = \tfrac12 \Big( \sum_{k=0}^{N-1} \lVert e_k \rVert_{Q_k}^2 + \lVert e_N
    \rVert_P^2 \Big) \quad (8) \qquad \mathrm{lex\,min} \; [\mathcal J_1, \mathcal J_2] \quad (7a)$$

    *Lex min* reads like a dictionary: first the smallest $\mathcal J_1$, and only among the plans
    that have it the smallest $\mathcal J_2$.
    """,
    do="Drag the base's target around the hand. From which side is it hardest to follow?",
    why=r"""
    Hundredths of a millimetre. The base drives off, and the arm takes back at every instant what
    the base does to the hand. With the base first (the ghost) both tasks end at their goals too, but
    on the way the hand swings out by 12 cm. Even where both tasks reach their goals, the priorities
    decide which one may be disturbed on the way.
    """,
    prediction=Choice(
        "While the base drives 64 cm away under it: how far is the hand ever off?",
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
            "The hand stays within 1 mm all along.",
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
            because="single-task MPC looks at the first task only",
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
    The hand stays where it is, and now the base is sent to a place 3.5 m away from the hand. The
    arm reaches 1.86 m. The second task cannot be done, so what is the best plan? Level 2 minimises
    $\mathcal J_2$ and must not make any error of level 1 larger than its best,

    $$|e_{kp}| \le |e_{kp}|^*, \quad k = 0, \ldots, N \quad (12)$$

    at every knot $k$ and in each coordinate $p$.
    """,
    do="Push the base's target around in a circle. What does the base draw on the floor?",
    why=r"""
    The base stops exactly where the arm is stretched, 1.63 m before its target, and the hand stays
    in its place. The program contains no rule for this place. It is where every plan that makes
    $\mathcal J_2$ smaller also changes $\mathcal J_1$. There the arm is singular: its
    manipulability $w = \sqrt{\det J J^\top}$ is almost zero.
    """,
    prediction=Choice(
        "The base's target cannot be reached while the hand stays. What happens to the hand?",
        (
            Option("it is drawn along by some centimetres, a compromise", low=10.0),
            Option("it trembles within a centimetre at the edge", 1.0, 10.0),
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
            because="the base drives on and takes the hand along",
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
    title="Turn the list round",
    text=r"""
    The same, and at 4 s, with the arm at full stretch, the two tasks change places. Now
    $\mathcal T_1$ is the base and $\mathcal T_2$ the hand: (12) protects the base.
    """,
    do="Is there a way back? Swap them once more while the base is on its way.",
    why=r"""
    The base goes the missing 1.63 m, and the hand is left behind by exactly these 1.63 m. The conflict
    is as large as before, only the other task loses: in a hierarchy it is the last one in the list.
    """,
    prediction=Value(
        "The base now gets to its target. How far is the hand off in the end, in m?",
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
            because="then the base was first from the beginning",
        ),
        Claim(
            "4.5 s after it the base is at its target.",
            Measure(BASE, "mean", after=8.5),
            "at most",
            0.01,
            fails_with=("limits.velocity_scale=0.2",),
            because="at a fifth of the speed it is still on its way",
        ),
        Claim(
            "The hand pays: it is left behind by more than 1.5 m.",
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

"""How far ahead

Model predictive control looks ahead: is a longer horizon always better?

Minutes: 10
You need: lesson "one-task"
"""

from __future__ import annotations

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/position", "mm")
ROUGH = Signal("delta_tau", "N·m")
TIME = Signal("step_us", "µs")
N = Control("horizon", "N", 1, 30)
R_ON = Control("R_on", "What R weighs", choices=("torque", "acceleration"))

FURTHER = Step(
    title="Twenty steps instead of one",
    text=r"""
    The arm follows the paper's circle. $N = 20$ means that the cost (32a) is summed over 20 steps of a
    millisecond, and that the first of 20 torque changes is applied. The ghost plans one step ahead (HIQP).
    Remark 9 says: choose $N$ as large as the computer allows. Our computer allows a large $N$: of the
    available millisecond, a step takes about 0.04 ms with $N = 5$, 0.12 with 20 and 0.21 with 30.
    """,
    do="Try N = 1, 2, 5, 10, 20 and read the time per step. Then keep N and double M̄.",
    why=r"""
    The error does not change. With $Q = 200$, $R = 10$ and such a small $\bar M$, the first $\Delta\tau$
    already removes nearly all of $e$: the controller is deadbeat, and the later steps of the plan have no
    error left to remove. The paper's Table VI prints a gain of 17 % in x from $N = 5$ to $N = 30$. Over the
    whole 4 s we find a third of that gain, because a longer horizon includes the ends of the joints' ranges
    sooner. Without position limits there is no gain. In the 1.2 s of this step no joint comes near an end.
    Over the 4 s the error in x is smaller with $N = 1$ than with $N = 30$, but 1600 QPs have no solution
    with $N = 1$. Twice the $\bar M$ halves the error; no horizon has this effect.
    """,
    prediction=Choice(
        "N = 20 instead of N = 1: the RMS error of the hand becomes …",
        (
            Option("clearly smaller", high=0.85),
            Option("about the same", 0.85, 1.2),
            Option("clearly larger", low=1.2),
        ),
        Measure(HAND, "rms", over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "The RMS error is at most 5 % smaller than with a horizon of one step.",
            Measure(HAND, "rms", over_ghost=True),
            "at least",
            0.95,
            fails_with=("M_bar_scale=2",),
            because="twice the M̄ halves the error, with any horizon",
        ),
        Claim(
            "The RMS error is at most 5 % larger than with a horizon of one step.",
            Measure(HAND, "rms", over_ghost=True),
            "at most",
            1.05,
            fails_with=("limits.position=viability",),
            because="with this lab's own bound on the speed towards a position limit, N = 20 is worse",
        ),
    ),
    set=("horizon=20",),
    duration=1.2,
    ghost=Ghost("N = 1", ("horizon=1",)),
    controls=(N, R_ON, Control("M_bar_scale", "M̄, factor", 0.5, 2.0)),
    plots=(HAND, ROUGH, TIME),
)

REASON = Step(
    title="Another meaning of R",
    text=r"""
    Let $R$ weigh the change of acceleration that a torque change makes, $\lVert \bar M^{-1} \Delta\tau
    \rVert_R^2$. In these units $R = 10$ is no longer small compared with $Q = 200$, so no step removes all
    of $e$. As before, $N = 20$, and the ghost has $N = 1$.
    """,
    do="Compare N = 1 with N = 20 for both meanings of R. Then set N = 1 and make R smaller, down to 0.1.",
    why=r"""
    Twenty steps give about half the error of one step, with smoother torques, which is the trend in the
    paper. But the longer horizon only changes the relative weight of the torque. A change of torque acts at
    all later knots. With $N = 20$ its cost counts once and its effect counts at twenty knots, so $R$ weighs
    less: $R = 10$ acts like 1.7 with $N = 1$. It does not act like $10/20$: the plan's later changes remove
    a part of $e$ as well, so the first change counts for fewer than twenty knots. A smaller $R$ has the
    same effect. With $R = 0.1$, a hundredth, one step ahead has a smaller error than twenty steps with $R =
    10$, and its torque is as smooth. At $R = 0.1$ the errors of the two horizons are equal. Even here
    another weight gives the same improvement as the longer horizon.
    """,
    prediction=Value(
        "R on accelerations: how many times as large is the RMS error with N = 20 as with N = 1?",
        Measure(HAND, "rms", over_ghost=True),
        low=0.1,
        high=10.0,
        factor=1.4,
    ),
    claims=(
        Claim(
            "The RMS error is at most 0.7 times that of one step ahead.",
            Measure(HAND, "rms", over_ghost=True),
            "at most",
            0.7,
            fails_with=("horizon=1",),
            because="then both robots have the same settings",
        ),
        Claim(
            "The torque is smoother: its changes are at most 0.8 times those of one step ahead.",
            Measure(ROUGH, "rms", over_ghost=True),
            "at most",
            0.8,
            fails_with=("R_on=torque",),
            because="deadbeat control is rough with any horizon",
        ),
    ),
    set=("R_on=acceleration", "horizon=20"),
    duration=1.2,
    ghost=Ghost("N = 1", ("horizon=1",)),
    controls=(N, R_ON, Control("R", "R", 0.1, 100.0, log=True)),
    plots=(HAND, ROUGH, TIME),
)

LESSON = Lesson(
    name="how-far-ahead",
    card=card_of(__doc__),
    scene="iiwa14-circle-paper",
    steps=(FURTHER, REASON),
)

"""How far ahead

Model predictive control looks ahead: is further always better?

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
    title="Twenty instead of one",
    text=r"""
    The arm follows the paper's circle. $N = 20$ means that the cost (32a) is summed over 20 steps
    of a millisecond, and that the first of 20 torque changes is applied. The ghost looks one step
    ahead (HIQP). Remark 9 says: choose $N$ as large as the computer allows. Ours would allow it: a
    step takes about 0.04 ms with $N = 5$, 0.12 with 20 and 0.21 with 30, of the millisecond there
    is.
    """,
    do="Go through N = 1, 2, 5, 10, 20 and read the time per step. Then leave N alone and double M̄.",
    why=r"""
    Nothing happens. With $Q = 200$, $R = 10$ and this small an $\bar M$, the very first $\Delta\tau$
    already removes nearly all of $e$: the controller is deadbeat, and there is nothing left to plan.
    The paper's Table VI prints a gain of 17 % in x from $N = 5$ to $N = 30$. Over the whole 4 s we find
    a third of that gain, because a longer horizon sees the ends of the joints' ranges sooner. Without
    position limits there is no gain. In the 1.2 s of this step no joint comes near an end. Over the 4 s
    the error in x is smaller with $N = 1$ than with $N = 30$, but with $N = 1$ 1600 QPs have no
    solution. Twice the $\bar M$ halves the error; no horizon does that.
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
            "The RMS error is not 5 % smaller than one step ahead.",
            Measure(HAND, "rms", over_ghost=True),
            "at least",
            0.95,
            fails_with=("M_bar_scale=2",),
            because="twice the M̄ halves it, whatever the horizon",
        ),
        Claim(
            "Nor is it 5 % larger.",
            Measure(HAND, "rms", over_ghost=True),
            "at most",
            1.05,
            fails_with=("limits.position=viability",),
            because="with this lab's own bound on the speed towards an end, N = 20 does worse than N = 1",
        ),
    ),
    set=("horizon=20",),
    duration=1.2,
    ghost=Ghost("N = 1", ("horizon=1",)),
    controls=(N, R_ON, Control("M_bar_scale", "M̄, factor", 0.5, 2.0)),
    plots=(HAND, ROUGH, TIME),
)

REASON = Step(
    title="A reason to plan?",
    text=r"""
    Let $R$ weigh the change of acceleration that a torque change makes, $\lVert \bar M^{-1}
    \Delta\tau \rVert_R^2$. In these units $R = 10$ is no longer small beside $Q = 200$, so no step
    removes all of $e$. Again $N = 20$, and the ghost has $N = 1$.
    """,
    do="Compare N = 1 with N = 20 for both meanings of R. Then set N = 1 and make R smaller, down to 0.1.",
    why=r"""
    Twenty steps make about half the error of one step, with smoother torques, which is the paper's
    trend. But what the longer horizon changes is the price of torque. A change of torque stays in force
    at all later knots. With $N = 20$ it is paid for once and counts at twenty knots, so $R$ weighs
    less: $R = 10$ acts like 1.7 with $N = 1$. It does not act like $10/20$: the plan's later changes
    remove a part of $e$ as well, so the first one counts for fewer than twenty knots. A smaller $R$
    does the same: with a hundredth of it, $R = 0.1$, one step ahead errs less than twenty steps with $R
    = 10$, and its torque is as smooth. At $R = 0.1$ the two horizons err alike. Even here the longer
    horizon gives nothing that another weight does not give.
    """,
    prediction=Value(
        "R on accelerations: the RMS error with N = 20 is how many times that with N = 1?",
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
            because="deadbeat control is rough, however far it looks",
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

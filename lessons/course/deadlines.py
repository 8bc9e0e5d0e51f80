"""Deadlines

The torque is due every millisecond: what happens if the computer is not ready?

Minutes: 10
You need: lesson "no-model-needed"; lesson "how-far-ahead"
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
LATE = Signal("late", "%")
MOVE = ((0.1, MoveTarget("position", (0.55, 0.42))),)
HORIZON = Control("horizon", "N", 1, 30)
DEADLINE = Control("deadline_ms", "Due after, ms (0: lockstep)", 0.0, 5.0)
PERIOD = Control("T_s", "Period, s", 0.001, 0.01)
M_BAR = Control("M_bar_scale", "M̄, factor", 0.1, 4.0, log=True)
PLOTS = (HAND, LATE, Signal("torque share", "%"))

ONE_MORE = Step(
    title="One knot more",
    text=r"""
    So far the simulated time stopped while the controller computed. Now the time continues: measuring,
    solving and applying the torque must all fit in $T_s = 1$ ms. If the torque is not ready when it is due,
    the motors hold the previous torque, and the late torque acts at the next tick. The lesson simulates a
    computer that needs 0.1 ms for each of the $N$ knots, on whichever machine the lab runs. (The lab's own
    step is faster and takes about 0.01 ms per knot.) With $N = 10$ the torque is just in time. Now $N =
    11$. The target moves by 13 cm in half a second.
    """,
    do="With a deadline of 2 ms, which N is the largest that is in time? What happens at N = 20 and N = 30?",
    why=r"""
    The error more than doubles with one additional knot. The longer horizon brings no gain, and every
    torque is one tick late. Each $\Delta\tau$ is computed as a change of the torque that acts at that
    moment. When $\Delta\tau$ is applied, another torque acts already. The even and the odd ticks form two
    sequences of torques. Each sequence is corrected only once in 2 ms, and neither contains the corrections
    of the other. No correction is lost, but each sequence is a control loop of half the rate.
    """,
    prediction=Choice(
        "With eleven knots instead of ten, each torque is 0.1 ms late: the largest error of this motion …",
        (
            Option("shrinks a little: a longer horizon covers more time", high=0.95),
            Option("stays the same within 30 %", 0.95, 1.3),
            Option("about doubles", 1.6, 3.0),
        ),
        Measure(HAND, over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "Every torque is late.",
            Measure(LATE, "mean"),
            "at least",
            99.0,
            fails_with=("horizon=10",),
            because="ten knots take exactly the available millisecond",
        ),
        Claim(
            "The largest error is at least 1.8 times as large as with a torque in time.",
            Measure(HAND, over_ghost=True),
            "at least",
            1.8,
            fails_with=("deadline_ms=0",),
            because="in lockstep, eleven knots give the same error as ten",
        ),
    ),
    set=("deadline_ms=1", "horizon=11"),
    events=MOVE,
    duration=1.2,
    ghost=Ghost("N = 10, in time", ("horizon=10",)),
    controls=(HORIZON, DEADLINE),
    plots=PLOTS,
)

SLOWER = Step(
    title="Half the rate, in time",
    text=r"""
    There are again eleven knots, but the controller computes a torque only every 2 ms. The torque is due
    after 2 ms, and is now in time. The prediction of the controller uses $T_s = 2$ ms as well. The ghost
    still computes a torque every millisecond and is always one tick late.
    """,
    do="Try 5 ms and 10 ms. From which period on is the arm no longer usable?",
    why=r"""
    The error is the same with half the computation. A loop in which every torque is one tick late follows
    no better than a loop of half the rate. With coarse sensors the late loop follows worse. With encoders
    of 0.005° the error of the hand is 47 mm in the late loop, and 3.2 mm in the loop of half the rate. In
    time and at the full rate, the hand is off by 1.5 mm with the same encoders, although the torque reaches
    its limit in that case, too. Besides the lateness, two conditions are necessary for so large an error.
    The first is that measured differences are divided by 1 ms: if the late controller divides by 2 ms
    instead, the error is 6.6 mm. The second is the torque limit: without this limit, in the bounds and in
    the motors, the late hand is off by 3.4 mm. The error grows with the period (Remark 6): that is why the
    paper requires 1 ms, and why it calls its own 8 ms per step on seven joints, at $N = 5$, too long.
    """,
    prediction=Value(
        "A torque every 2 ms in time, against a torque every 1 ms that is one tick late: the ratio of the "
        "largest errors is …",
        Measure(HAND, over_ghost=True),
        low=0.1,
        high=10.0,
        factor=1.3,
    ),
    claims=(
        Claim(
            "The largest error is at most 10 % larger than with the full rate and a late torque.",
            Measure(HAND, over_ghost=True),
            "at most",
            1.1,
            fails_with=("T_s=0.005", "deadline_ms=5"),
            because="a loop with a torque every 5 ms is slower",
        ),
        Claim(
            "No torque is late.",
            Measure(LATE, "mean"),
            "at most",
            0.0,
            fails_with=("deadline_ms=1",),
            because="a longer period alone does not change the deadline",
        ),
    ),
    set=("T_s=0.002", "deadline_ms=2", "horizon=11"),
    events=MOVE,
    duration=1.2,
    ghost=Ghost("every 1 ms, one tick late", ("T_s=0.001", "deadline_ms=1")),
    controls=(PERIOD, DEADLINE, HORIZON),
    plots=PLOTS,
)

REPAIR = Step(
    title="A larger M̄ for a late torque",
    text=r"""
    The torque is one tick late again. A small $\bar M$ and a late torque have the same effect: corrections
    are too slow. So let $\bar M$ be twice as large. The torque of the ghost is in time, with the old $\bar
    M$.
    """,
    do="Try factors of 2.5 and 3. What happens if the torque is in time again, with N = 10?",
    why=r"""
    To three digits, the late controller now has the same error as the controller in time.
    But its stability margin is smaller: the limit of stability is still between 2 and 2.5 times the old
    $\bar M$. The effect of noise doubles.
    """,
    prediction=Choice(
        "The torque is always one tick late, but M̄ is doubled. Compared to a torque in time the error is …",
        (
            Option("still clearly larger", low=1.2),
            Option("the same within 10 %", 0.9, 1.1),
            Option("clearly smaller", high=0.8),
        ),
        Measure(HAND, over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "The largest error is at most 10 % larger than with a torque in time.",
            Measure(HAND, over_ghost=True),
            "at most",
            1.1,
            fails_with=("M_bar_scale=1",),
            because="with the old M̄ the corrections are too slow",
        ),
    ),
    set=("deadline_ms=1", "horizon=11", "M_bar_scale=2"),
    events=MOVE,
    duration=1.2,
    ghost=Ghost("in time, with the old M̄", ("horizon=10", "M_bar_scale=1")),
    controls=(M_BAR, HORIZON, DEADLINE),
    plots=PLOTS,
)

CHALLENGE = Challenge(
    text=r"""
    The computer is slower: it needs 0.4 ms per knot, and $N = 5$. The deadline and the period stay 1 ms.
    Keep the hand within 2 mm without chatter. There is more than one solution.
    """,
    goals=(
        Claim("The hand stays within 2 mm.", Measure(HAND), "at most", 2.0),
        Claim(
            "Torque changes stay below 0.1 N·m RMS.",
            Measure(Signal("delta_tau", "N·m"), "rms"),
            "at most",
            0.1,
        ),
    ),
    knobs=(
        HORIZON,
        M_BAR,
        Control("tasks.position.K_p", "K_P of the position, 1/s²", 10.0, 400.0, log=True),
        Control("tasks.position.K_v", "K_V of the position, 1/s", 2.0, 60.0),
    ),
    score=Score(Measure(HAND), worst=2.0, best=0.7),
    solutions=(("horizon=2",), ("M_bar_scale=2",), ("tasks.position.K_p=400", "tasks.position.K_v=40")),
    set=("deadline_ms=1", "solve_ms_per_knot=0.4"),
    events=MOVE,
    duration=1.2,
)

LESSON = Lesson(
    name="deadlines",
    card=card_of(__doc__),
    scene="planar3-hold",
    set=("avoidance.on=false", "limits.stall_guard=false"),
    steps=(ONE_MORE, SLOWER, REPAIR),
    challenge=CHALLENGE,
)

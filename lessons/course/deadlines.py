"""Deadlines

The torque is due every millisecond: what if the computer is not ready?

Minutes: 10
You need: lesson "no-model-needed"
"""

from __future__ import annotations

from lessons.challenge import Challenge, Score
from lessons.claim import Claim
from lessons.control import Control
from lessons.events import MoveTarget
from lessons.lesson import Ghost, Lesson, Step, card_of
from lessons.measure import Measure, Signal
from lessons.prediction import Choice, Option, Value

HAND = Signal("error/position", "mm")
MOVE = ((0.1, MoveTarget("position", (0.55, 0.42))),)
DELAY = Control("plant.delay_ms", "Result late by, ms", 0.0, 8.0)
PERIOD = Control("T_s", "Period, s", 0.001, 0.01)
M_BAR = Control("M_bar_scale", "M̄, factor", 0.1, 4.0, log=True)
PLOTS = (HAND, Signal("torque share", "%"), Signal("step_us", "µs"))

LATE = Step(
    title="One tick late",
    text=r"""
    Measure, solve, apply: all within $T_s = 1$ ms. A computer that takes a little more than that
    misses the deadline, the motors hold the previous torque, and the result acts one millisecond
    late. Time-delay estimation (8) lives on fresh values. How late the result is, is set here and
    not measured, so that every run is the same. The target moves by 13 cm in half a second.
    """,
    do="Look at the time per step of your own machine. How long a horizon does it manage within 1 ms?",
    why=r"""
    The error doubles. Each $\Delta\tau$ is meant as a change of the torque that acts now; when it
    arrives, that torque is already the result of another $\Delta\tau$, so two corrections are made
    from the same starting point and every other one is lost. One millisecond late is not a tenth of
    a per cent of a second's motion: it is half of the feedback.
    """,
    prediction=Choice(
        "Everything arrives one millisecond late. The largest error of this half-second motion …",
        (
            Option("grows by a few per cent", high=1.2),
            Option("about doubles", 1.6, 3.0),
            Option("explodes", low=10.0),
        ),
        Measure(HAND, over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "The largest error is at least 1.8 times that of an arm in time.",
            Measure(HAND, over_ghost=True),
            "at least",
            1.8,
            fails_with=("plant.delay_ms=0",),
            because="then it is the ghost",
        ),
    ),
    set=("plant.delay_ms=1",),
    events=MOVE,
    duration=1.2,
    ghost=Ghost("in time", ("plant.delay_ms=0",)),
    controls=(DELAY, Control("horizon", "N", 1, 30)),
    plots=PLOTS,
)

SLOWER = Step(
    title="Promise less, keep it",
    text=r"""
    The other way out of the same trouble: ask only every 2 ms and be in time. The controller is
    told, so its prediction uses $T_s = 2$ ms. The ghost keeps asking every millisecond and is
    always one late.
    """,
    do="Try 5 ms and 10 ms. Where does it stop to be usable?",
    why=r"""
    The same error, with half the computing. A loop that misses every deadline by one tick is a loop
    at half the rate that does not know it. Error grows with the period (Remark 6): that is why the
    paper insists on 1 ms, and why its 8 ms per step on seven joints (Table VII) is a problem.
    """,
    prediction=Value(
        "Every 2 ms and in time, against every 1 ms and one late: the ratio of the largest errors is …",
        Measure(HAND, over_ghost=True),
        low=0.1,
        high=10.0,
        factor=1.3,
    ),
    claims=(
        Claim(
            "Half the rate in time is no worse than the full rate one tick late (within 10 %).",
            Measure(HAND, over_ghost=True),
            "at most",
            1.1,
            fails_with=("T_s=0.005",),
            because="every 5 ms is slower than that",
        ),
    ),
    set=("T_s=0.002",),
    events=MOVE,
    duration=1.2,
    ghost=Ghost("every 1 ms, one late", ("T_s=0.001", "plant.delay_ms=1")),
    controls=(PERIOD, DELAY),
    plots=PLOTS,
)

REPAIR = Step(
    title="Buy it back",
    text=r"""
    One tick late again. A small $\bar M$ and a late result have the same effect, corrections come
    too slowly. So let $\bar M$ be twice as large. The ghost is in time, with the old $\bar M$.
    """,
    do="Now go on: 2.5, 3. And what if the computer becomes fast again?",
    why=r"""
    The lost half is back: the errors are the same to the third digit. It was paid for with the
    margin: the cliff is where it was, between 2 and 2.5 times the old $\bar M$, and noise counts
    double. Time is bought with robustness, never for nothing.
    """,
    prediction=Choice(
        "One millisecond late, but M̄ doubled. Compared with an arm in time the error is …",
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
            "The largest error is at most 10 % above that of an arm in time.",
            Measure(HAND, over_ghost=True),
            "at most",
            1.1,
            fails_with=("M_bar_scale=1",),
            because="the lost half is not made up for",
        ),
    ),
    set=("plant.delay_ms=1", "M_bar_scale=2"),
    events=MOVE,
    duration=1.2,
    ghost=Ghost("in time, M̄ as it was", ("plant.delay_ms=0", "M_bar_scale=1")),
    controls=(M_BAR, DELAY),
    plots=PLOTS,
)

CHALLENGE = Challenge(
    text="Every result is two milliseconds late. Keep the hand within 3.5 mm without chatter.",
    goals=(
        Claim("The hand stays within 3.5 mm.", Measure(HAND), "at most", 3.5),
        Claim(
            "Torque changes stay below 0.1 N·m RMS.",
            Measure(Signal("delta_tau", "N·m"), "rms"),
            "at most",
            0.1,
        ),
    ),
    knobs=(
        M_BAR,
        Control("tasks.position.K_p", "K_P of the position, 1/s²", 10.0, 400.0, log=True),
        Control("tasks.position.K_v", "K_V of the position, 1/s", 2.0, 60.0),
    ),
    score=Score(Measure(HAND), worst=3.5, best=1.0),
    solutions=(("M_bar_scale=2",), ("tasks.position.K_p=400", "tasks.position.K_v=40")),
    set=("plant.delay_ms=2",),
    events=MOVE,
    duration=1.2,
)

LESSON = Lesson(
    name="deadlines",
    card=card_of(__doc__),
    scene="planar3-hold",
    steps=(LATE, SLOWER, REPAIR),
    challenge=CHALLENGE,
)

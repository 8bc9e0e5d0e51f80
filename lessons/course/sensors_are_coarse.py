"""Sensors are coarse

A sensor rounds to five thousandths of a degree: does this have a visible effect?

Minutes: 10
You need: lesson "no-model-needed"
"""

from __future__ import annotations

from lessons.teaching.challenge import Challenge, Score
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/position", "mm")
ROUGH = Signal("delta_tau", "N·m")
TORQUE = Signal("torque share", "%")
PLOTS = (Signal("tau", "N·m", column=0), ROUGH, HAND)
RESOLUTION = Control("plant.encoder_resolution_deg", "Resolution, °", 0.0, 0.02)
PERIOD = Control("T_s", "Period, s", 0.0005, 0.01)
M_BAR = Control("M_bar_scale", "M̄, factor", 0.05, 2.0, log=True)
COARSE = "plant.encoder_resolution_deg=0.005"

ROUNDING = Step(
    title="Two differences",
    text=r"""
    The encoders round to $\delta = 0.005°$: at the hand this is 0.08 mm. Velocity is the difference of two
    positions divided by $T_s$, and acceleration is the difference of two velocities divided by $T_s$. If one
    position changes by $\delta$, the computed acceleration changes by $\delta / T_s^2$, and the torque change
    in (13) is $\bar M\,\delta / T_s^2$.
    """,
    do="Make the encoders finer until you cannot see the noise in the torque any more.",
    why=r"""
    A single step $\delta$ changes the torque by $\bar M \delta / T_s^2 = 0.033 \cdot 8.7 \cdot 10^{-5} /
    10^{-6} = 2.9$ N·m, and 4 N·m are available. With finer encoders the noise decreases in proportion. The
    hand hardly moves in spite of the noise. The paper measures the same noise (Table VIII) and calls it
    chattering.
    """,
    prediction=Choice(
        "Without rounding the motion needs 3 % of the torque limit. With rounding, the largest demand is …",
        (
            Option("still about 3 %", high=8.0),
            Option("10 to 30 %", 10.0, 30.0),
            Option("more than half the limit", low=50.0),
        ),
        Measure(TORQUE),
        tempting=0,
    ),
    claims=(
        Claim(
            "The torque changes by more than 1 N·m RMS from one millisecond to the next.",
            Measure(ROUGH, "rms"),
            "at least",
            1.0,
            fails_with=("plant.encoder_resolution_deg=0",),
            because="ideal sensors give a smooth torque",
        ),
        Claim(
            "The hand still stays within half a millimetre.",
            Measure(HAND),
            "at most",
            0.5,
            fails_with=("plant.encoder_resolution_deg=0.02",),
            because="then the noise alone takes all the torque",
        ),
    ),
    set=(COARSE,),
    duration=0.8,
    ghost=Ghost("ideal sensors", ("plant.encoder_resolution_deg=0",)),
    controls=(RESOLUTION,),
    plots=PLOTS,
)

SQUARE = Step(
    title="The square of the period",
    text=r"""
    The resolution stays the same. The period becomes $T_s = 2$ ms instead of 1 ms; the ghost keeps 1 ms. A
    slower loop follows less well. What is its effect on the noise?
    """,
    do="Set 4 ms. Then change M̄ instead: which factor has the same effect on the noise?",
    why=r"""
    $\bar M \delta / T_s^2$ contains the square of the period: twice the period gives a quarter of the
    noise, while the error grows by little more than half. With coarse sensors a faster loop is not better.
    $\bar M$ enters to the first power: half of $\bar M$ leaves half of the noise, and again the error grows
    by little more than half.
    """,
    prediction=Value(
        "T_s is twice as long. How many times as large are the changes of torque?",
        Measure(ROUGH, "rms", over_ghost=True),
        low=0.05,
        high=5.0,
        factor=1.4,
    ),
    claims=(
        Claim(
            "The torque changes are at most 0.4 times as large as with 1 ms.",
            Measure(ROUGH, "rms", over_ghost=True),
            "at most",
            0.4,
            fails_with=("T_s=0.001",),
            because="then both robots have the same settings",
        ),
        Claim(
            "The largest error of the hand grows by less than three quarters.",
            Measure(HAND, over_ghost=True),
            "at most",
            1.75,
            fails_with=("T_s=0.01",),
            because="ten times the period is too slow for the circle",
        ),
        Claim(
            "The hand still stays within half a millimetre.",
            Measure(HAND),
            "at most",
            0.5,
            fails_with=("controller=osf",),
            because="OSF's torque is smoother, but its model has no friction",
        ),
    ),
    set=(COARSE, "T_s=0.002"),
    duration=0.8,
    ghost=Ghost("every 1 ms", ("T_s=0.001",)),
    controls=(PERIOD, M_BAR, RESOLUTION),
    plots=PLOTS,
)

CHALLENGE = Challenge(
    text=r"""
    The encoders round to 0.005°. Bring the torque changes below 0.5 N·m RMS while the hand stays within
    half a millimetre of its circle.
    """,
    goals=(
        Claim("Torque changes stay below 0.5 N·m RMS.", Measure(ROUGH, "rms"), "at most", 0.5),
        Claim("The hand stays within 0.5 mm.", Measure(HAND), "at most", 0.5),
    ),
    knobs=(PERIOD, M_BAR, Control("R", "R of both levels", 0.1, 1e6, log=True)),
    score=Score(Measure(ROUGH, "rms"), worst=0.5, best=0.1),
    solutions=(("T_s=0.004",), ("T_s=0.002", "M_bar_scale=0.4")),
    set=(COARSE,),
    duration=1.2,
)

LESSON = Lesson(
    name="sensors-are-coarse",
    card=card_of(__doc__),
    scene="planar3-circle",
    steps=(ROUNDING, SQUARE),
    challenge=CHALLENGE,
)

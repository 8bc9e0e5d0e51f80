"""No model needed

The robot lifts a weight that its controller does not know: does the hand sag?

Minutes: 12
You need: lesson "one-task"; mass times acceleration is force
"""

from __future__ import annotations

from lessons.events import MoveTarget, Set
from lessons.teaching.challenge import Challenge, Score
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/position", "mm")
GAUGE = Signal("gauge_radius")
ASIDE = (0.556, 0.12, 0.448)
MOVE = ((0.1, MoveTarget("position", ASIDE)),)
M_BAR = Control("M_bar_scale", "M̄, factor", 0.1, 40.0, log=True)

LOAD = Step(
    title="Pick up a kilogram",
    text=r"""
    At 0.2 s one kilogram is attached to the hand. The controller has no information about this load. It has
    no identified model, only one number in kg·m² per joint, $\bar M$. All unknown terms are collected in
    one term (6),

    $$\bar M \ddot q + H_q = \tau,$$

    and $H_q$ is estimated by its value of a millisecond ago (8): $H_q \approx \tau_0 - \bar M \ddot q_0$,
    from the last torque and the acceleration under this torque. So (13) only contains the *change*: $\ddot
    x = \ddot x_0 + J \bar M^{-1} \Delta\tau$. The ghost knows the exact model of the arm, but not the load.
    """,
    do="Attach more weight, and remove it again.",
    why=r"""
    The hand dips by a few millimetres and comes back, to a hundredth of a millimetre. The effect of the
    load on the acceleration is measured, and in the next millisecond the load is part of $H_q$. Then the
    hand stops sagging, and the spring of (4) brings it back. Without a spring, $K_P = 0$, the hand stays
    3.3 mm too low. The ghost's model is exact except for the kilogram; only its springs carry the kilogram,
    so it sags by centimetres and stays there.
    """,
    prediction=Choice(
        "One kilogram that the controller does not know of: where is the hand 1.5 s later?",
        (
            Option("back on its target, within 0.1 mm", high=0.1),
            Option("some millimetres too low", 0.1, 10.0),
            Option("centimetres too low", low=10.0),
        ),
        Measure(HAND, "last"),
        tempting=1,
    ),
    claims=(
        Claim(
            "The hand never sags by more than 5 mm.",
            Measure(HAND),
            "at most",
            5.0,
            fails_with=("controller=hqp",),
            because="if the model does not contain the load, only the springs of (4) carry it",
        ),
        Claim(
            "In the end the hand is within 0.1 mm of its target.",
            Measure(HAND, "last"),
            "at most",
            0.1,
            fails_with=("controller=hqp",),
            because="HQP has a model without the load, and does not estimate the load",
        ),
    ),
    events=((0.2, Set("plant.payload_kg", 1.0)),),
    duration=2.0,
    ghost=Ghost("hqp: exact model of the arm, without the load", ("controller=hqp",)),
    controls=(
        Control("plant.payload_kg", "Payload, kg", 0.0, 5.0),
        Control("controller", "Controller", choices=("himpc", "hqp", "osf")),
    ),
    plots=(HAND,),
)

SMALL = Step(
    title="M̄ too small",
    text=r"""
    One quantity must be chosen, the diagonal $\bar M$. It determines the torque for a desired acceleration.
    Now $\bar M$ is 0.3 times its old value: the controller assumes a lighter arm, and its torque changes
    are three tenths of the old changes. The target moves aside by 13 cm.
    """,
    do="Reduce the factor to 0.1, then raise it to 2, and watch the gauge.",
    why=r"""
    The torque is right in the end, but it comes late: every millisecond only a part of the error in $\ddot
    q$ is removed. The gauge shows the spectral radius of $I - M^{-1}\bar M$: after each step, this share of
    the slowest component of the error is left. Here a gauge close to 1 means *slow*, with an eigenvalue
    near +1. An eigenvalue near −1 would give the same radius and mean *almost unstable*. The radius alone
    does not distinguish the two cases.
    """,
    prediction=Value(
        "With 0.3 M̄ instead of M̄: how many times larger is the largest error?",
        Measure(HAND, over_ghost=True),
        low=0.1,
        high=30.0,
        factor=1.6,
    ),
    claims=(
        Claim(
            "The largest error is more than three times that of the ghost.",
            Measure(HAND, over_ghost=True),
            "at least",
            3.0,
            fails_with=("M_bar_scale=1",),
            because="then both robots have the same settings",
        ),
        Claim(
            "The gauge stays above 0.99: less than a hundredth of the slowest error is removed in a "
            "millisecond.",
            Measure(GAUGE, "mean"),
            "at least",
            0.99,
            fails_with=("M_bar_scale=2",),
            because="a larger M̄ corrects faster",
        ),
    ),
    set=("M_bar_scale=0.3",),
    events=MOVE,
    duration=1.2,
    ghost=Ghost("the old M̄", ("M_bar_scale=1",)),
    controls=(M_BAR,),
    plots=(HAND, GAUGE),
)

FURTHER = Step(
    title="Beyond the proof",
    text=r"""
    With twice the original $\bar M$, 0.41 of the error is left. Now $\bar M$ is four times the original.
    Remark 4 guarantees that the errors stay bounded if $\lVert I - M^{-1} \bar M \rVert < 1$. For four times
    $\bar M$ this norm is 1.21 at the start.
    """,
    do="Raise M̄ from 1. Which of the two numbers begins to rise first, norm or radius?",
    why=r"""
    The error is less than a fifth of the ghost's, and the arm does not vibrate. A norm below 1 is sufficient
    for stability, but not necessary: such a norm means that *no* error grows, not even for a single step. In
    the long run the eigenvalues decide, and the largest of them is 0.94.
    """,
    claims=(
        Claim(
            "The norm of Remark 4 is above 1.2: here the remark guarantees nothing.",
            Measure(Signal("gauge_norm"), "mean"),
            "at least",
            1.2,
            fails_with=("M_bar_scale=1",),
            because="with the old M̄ the norm is 0.999",
        ),
        Claim(
            "The spectral radius is below 0.95.",
            Measure(GAUGE, "mean"),
            "at most",
            0.95,
            fails_with=("M_bar_scale=7",),
            because="with this M̄ the fastest eigenvalue has passed −1",
        ),
        Claim(
            "The largest error is at most a quarter of the ghost's.",
            Measure(HAND, over_ghost=True),
            "at most",
            0.25,
            fails_with=("M_bar_scale=2",),
            because="twice the M̄ still leaves 0.41 of the ghost's error",
        ),
    ),
    set=("M_bar_scale=4",),
    events=MOVE,
    duration=0.6,
    ghost=Ghost("the old M̄", ("M_bar_scale=1",)),
    controls=(M_BAR,),
    plots=(HAND, GAUGE, Signal("gauge_norm")),
)

LARGE = Step(
    title="M̄ too large",
    text=r"""
    With four times the $\bar M$, less than a fifth of the error remained. With six times the $\bar M$, even
    less remains. Now $\bar M$ is eight times as large. For each eigenvalue $\lambda$ of $M^{-1}\bar M$ a
    component of the error is multiplied by $1 - \lambda$ in every step. (Remark 4 prints the factor $1 -
    \bar M_i/\lambda_i(M)$, which is the same for a diagonal $M$ only.)
    """,
    do="Reset, raise M̄ from 4 in small steps, and read the gauge each time before you run the simulation.",
    why=r"""
    The smallest $1 - \lambda$ has passed −1: each correction is more than twice as large as it should be,
    and every millisecond the error grows by half and changes its sign. The arm chatters, reaches full
    torque and becomes unstable. At × 6 the gauge read 0.91, its smallest value: the factor of the slowest
    component was 0.91, that of the fastest −0.89. With a larger $\bar M$ the factor of the fastest component
    is the largest in size: −1.21 at × 7. So start small, go up in small steps, and stop when the gauge begins
    to rise: there the limit of stability is near.
    """,
    prediction=Choice(
        "M̄ × 2, × 4 and × 6 were better each time. What happens at × 8?",
        (
            Option("better again, or as good", high=1.5),
            Option("a little worse", 1.5, 5.0),
            Option("it loses control", low=5.0),
        ),
        Measure(HAND, over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "The gauge is above 1: errors grow from step to step.",
            Measure(GAUGE, "mean"),
            "at least",
            1.0,
            fails_with=("M_bar_scale=4",),
            because="with half of this M̄ every factor 1 − λ of the error lies between −1 and 1",
        ),
        Claim(
            "From × 6 to × 8 the gauge goes up by more than half.",
            Measure(GAUGE, "mean", over_ghost=True),
            "at least",
            1.5,
            fails_with=("M_bar_scale=6.5",),
            because="with this M̄ the gauge has only just begun to rise",
        ),
        Claim(
            "A joint exceeds its speed limit at least threefold.",
            Measure(Signal("speed share", "%")),
            "at least",
            300.0,
            fails_with=("M_bar_scale=4",),
            because="with half of this M̄ the motion is smooth, and more accurate than before",
        ),
    ),
    set=("M_bar_scale=8",),
    events=MOVE,
    duration=0.35,
    ghost=Ghost("M̄ × 6", ("M_bar_scale=6",)),
    controls=(M_BAR,),
    plots=(HAND, GAUGE, Signal("torque share", "%")),
)

CHALLENGE = Challenge(
    text=r"""
    The load is three kilograms, and at 0.8 s the target moves aside by 13 cm. Keep the hand within 10 mm of
    its target all the time.
    """,
    goals=(
        Claim("The hand stays within 10 mm.", Measure(HAND), "at most", 10.0),
        Claim(
            "The torque does not chatter: changes below 1 N·m RMS.",
            Measure(Signal("delta_tau", "N·m"), "rms"),
            "at most",
            1.0,
        ),
    ),
    knobs=(
        M_BAR,
        Control("tasks.position.K_p", "K_P of the position, 1/s²", 10.0, 400.0, log=True),
        Control("tasks.position.K_v", "K_V of the position, 1/s", 2.0, 60.0),
    ),
    score=Score(Measure(HAND), worst=10.0, best=3.0),
    solutions=(
        ("M_bar_scale=4",),
        ("M_bar_scale=3", "tasks.position.K_p=200", "tasks.position.K_v=28"),
    ),
    events=((0.2, Set("plant.payload_kg", 3.0)), (0.8, MoveTarget("position", ASIDE))),
    duration=2.0,
)

LESSON = Lesson(
    name="no-model-needed",
    card=card_of(__doc__),
    scene="iiwa14-hold",
    set=("avoidance.on=false", "limits.stall_guard=false"),
    steps=(LOAD, SMALL, FURTHER, LARGE),
    challenge=CHALLENGE,
)

"""A blind arm

An arm that measures only its joints is sent into a table: how hard does it press?

Minutes: 10
You need: lesson "no-model-needed"; lesson "torque-has-a-limit"
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
FORCE = Signal("contact_force", "N")
DISTANCE = Signal("distance", "mm")
TORQUE = Signal("torque share", "%")
SPEED = Signal("speed share", "%")
ELBOW = Signal("v", "deg/s", column=4)
INTO = ((0.1, MoveTarget("position", (0.556, 0.0, 0.19))),)
MOTORS_ONLY = ("limits.torque=false",)
SCALE = Control("limits.torque_scale", "Torque limit, factor", 0.12, 1.0, log=True)
CONTROLLER = Control("controller", "Controller", choices=("himpc", "tdeosf", "osf"))
MASS = Control("M_bar_scale", "M̄, factor", 0.25, 1.0)
STIFFNESS = Control("levels.position.K_p", "K_P of the hand, 1/s²", 10.0, 100.0, log=True)

UNSEEN = Step(
    title="A table one centimetre too high",
    text=r"""
    The target of the hand moves straight down, to 1 cm below the surface of a table. The controller has no
    information about the table. It estimates all forces on the arm from the last torque and acceleration,

    $$\tau_0 - \bar M \ddot q_0,$$

    and compensates for the estimate. The ghost is OSF, which computes its torque from a model of the arm.
    """,
    do="Switch to OSF with time-delay estimation (tdeosf). Halve M̄. What makes the force grow?",
    why=r"""
    The force grows by more than 200 N per second. The force of the table is part of the estimate, so the
    controller compensates for this force, as it compensated for the unknown weight in lesson *No model
    needed*. In addition, the remaining error of one centimetre increases the torque every millisecond. OSF
    with time-delay estimation has no horizon and presses as hard, so MPC is not to blame for this force.
    With half of $\bar M$ the arm presses half as hard. After an impact the ghost acts like a spring: for
    one centimetre of error it presses with 4 N.
    """,
    prediction=Choice(
        "The target lies 1 cm inside the table. Two seconds after the target has moved, the arm presses "
        "with …",
        (
            Option("a few newtons, as a soft spring would", high=20.0),
            Option("less than a hundred newtons", 20.0, 100.0),
            Option("several hundred newtons", low=300.0),
        ),
        Measure(FORCE, "last"),
        tempting=0,
    ),
    claims=(
        Claim(
            "At the end the arm presses with more than 300 N.",
            Measure(FORCE, "last"),
            "at least",
            300.0,
            fails_with=("controller=osf",),
            because="without time-delay estimation the arm acts like a spring",
        ),
        Claim(
            "In the last half second the force grows by more than 80 N.",
            Measure(FORCE, "range", after=1.7),
            "at least",
            80.0,
            fails_with=("M_bar_scale=0.5",),
            because="with half of M̄ the force grows half as fast",
        ),
    ),
    events=INTO,
    duration=2.2,
    ghost=Ghost("osf, with the model", ("controller=osf",)),
    controls=(CONTROLLER, MASS, STIFFNESS),
    plots=(FORCE, HAND, TORQUE),
)

BOUND = Step(
    title="Who limits the force?",
    text=r"""
    The motion is the same, but the bound of the torque (32f) is a quarter of the torque of the motors:

    $$\tau_{\min} \le \tau_0 + \sum_{s=0}^{j} \Delta\tau_{k+s} \le \tau_{\max}$$
    """,
    do="Halve K_P, and let the simulation go on for a second. Does the arm press less, or only later?",
    why=r"""
    The torque and the force grow until joints 2 and 4 are at their bounds. Stiffness does not limit the
    force: with half of $K_p$ both bounds are reached, too, up to 0.9 s later and at the same force. With
    the full torque of its motors the arm presses with 650 N after 4 s, and joint 2 is at its bound again. A
    bound of the torque does not replace a bound of the force: the bound of the torque also limits the
    deceleration of the arm, and the load that it can carry.
    """,
    prediction=Value(
        "With a quarter of the torque: how hard does the arm press at the end, in N?",
        Measure(FORCE, "last"),
        low=10.0,
        high=1000.0,
        factor=1.4,
    ),
    claims=(
        Claim(
            "The arm presses with less than 230 N.",
            Measure(FORCE, "last"),
            "at most",
            230.0,
            fails_with=("limits.torque_scale=1",),
            because="then the torque continues to grow",
        ),
        Claim(
            "A joint is at its bound.",
            Measure(TORQUE),
            "at least",
            99.9,
            fails_with=("limits.torque_scale=1",),
            because="two seconds are too short for the torque to reach its bound",
        ),
    ),
    set=("limits.torque_scale=0.25",),
    events=INTO,
    duration=2.2,
    controls=(SCALE, STIFFNESS),
    plots=(FORCE, TORQUE, HAND),
)

UNREST = Step(
    title="Does the arm come to rest?",
    text=r"""
    The same run goes on for 8 s. The ghost has no bound (32f) in its QPs. Its motors alone limit the torque,
    each at its own limit $\tau_m$:

    $$\tau \leftarrow \max(-\tau_m, \min(\tau, \tau_m))$$
    """,
    do="Switch the bound off. Then try N = 1 with the bound. Does the elbow come to rest?",
    why=r"""
    With two joints at their bounds the elbow swings four times a second, and the hand moves by less than a
    millimetre meanwhile. After 6 s the wrist gives way, and joints pass their speed limits. The bound
    inside the QPs is the cause: the ghost stays at rest and presses with 655 N, with joint 2 at the limit
    of its motor. Motors a quarter as strong would leave 220 N, at rest, too. The horizon is not the cause:
    with $N = 1$ the elbow swings as well. The paper does not mention this property of its controller, and
    we do not know why the levels find no rest at this bound.
    """,
    prediction=Choice(
        "Joints 2 and 4 are at their bounds. From 2 s to 5 s the fastest joint turns …",
        (
            Option("hardly at all: the arm presses and rests", high=5.0),
            Option("with up to a third of its speed limit", 5.0, 33.0),
            Option("with more than half of its speed limit", low=50.0),
        ),
        Measure(SPEED, "largest", 2.0, 5.0),
        tempting=0,
    ),
    claims=(
        Claim(
            "From 2 s to 5 s joint 5 swings with more than 60°/s.",
            Measure(ELBOW, "largest", 2.0, 5.0),
            "at least",
            60.0,
            fails_with=MOTORS_ONLY,
            because="then only the motors limit the torque, and the arm stays at rest",
        ),
        Claim(
            "Within 8 s a joint turns at more than 1.5 times its speed limit.",
            Measure(SPEED),
            "at least",
            150.0,
            fails_with=MOTORS_ONLY,
            because="then the arm presses at rest for the whole time",
        ),
    ),
    set=("limits.torque_scale=0.25",),
    events=INTO,
    duration=8.0,
    ghost=Ghost("only the motors limit the torque", MOTORS_ONLY),
    controls=(
        Control("limits.torque", "Bound of the torque (32f)", choices=(True, False)),
        Control("horizon", "N", 1, 10),
    ),
    plots=(ELBOW, FORCE, SPEED),
)

SEEN = Step(
    title="Seen, not felt",
    text=r"""
    Now the controller knows the position of the table, and bounds the speed with which any link may
    approach the table or any other object. The next lesson shows how.
    """,
    do="Lower d_safe to 0 mm. Can the arm be made to touch the table lightly?",
    why=r"""
    The arm stops above the table, and its motors have nothing to push against. The controller keeps a
    distance, and does not control a force: this arm cannot press at all, even where it should. An arm that
    must wipe a table needs a measurement of the contact force.
    """,
    claims=(
        Claim(
            "Nothing is touched.",
            Measure(FORCE),
            "at most",
            0.0,
            fails_with=("avoidance.on=false",),
            because="the controller has no information about the table",
        ),
        Claim(
            "The nearest pair stays more than 10 mm apart.",
            Measure(DISTANCE, "smallest"),
            "at least",
            10.0,
            fails_with=("avoidance.on=false",),
            because="the hand reaches the table",
        ),
        Claim(
            "The arm needs less than 30 % of its torque.",
            Measure(TORQUE),
            "at most",
            30.0,
            fails_with=("avoidance.on=false",),
            because="pressing on the table needs more torque",
        ),
    ),
    set=("avoidance.on=true",),
    events=INTO,
    duration=2.2,
    controls=(
        Control("avoidance.on", "Distances are kept", choices=(False, True)),
        Control("avoidance.d_safe", "d_safe, m", 0.0, 0.05),
    ),
    plots=(DISTANCE, FORCE, TORQUE),
)

CHALLENGE = Challenge(
    text=r"""
    The controller has no information about the table. Let the arm press at rest: after 6 s with at least
    100 N and at most 300 N, and from 2 s on with no joint faster than a tenth of its speed limit. The score
    is the growth of the force in the last second.
    """,
    goals=(
        Claim("After 6 s the arm presses with at least 100 N.", Measure(FORCE, "last"), "at least", 100.0),
        Claim("After 6 s the arm presses with at most 300 N.", Measure(FORCE, "last"), "at most", 300.0),
        Claim(
            "From 2 s on every joint is slower than a tenth of its limit.",
            Measure(SPEED, "largest", 2.0),
            "at most",
            10.0,
        ),
    ),
    knobs=(SCALE, STIFFNESS, MASS),
    score=Score(Measure(FORCE, "range", 5.0), worst=60.0, best=15.0),
    solutions=(
        ("levels.position.K_p=10",),
        ("levels.position.K_p=10", "M_bar_scale=0.5"),
        ("M_bar_scale=0.25",),
    ),
    events=INTO,
    duration=6.0,
)

LESSON = Lesson(
    name="a-blind-arm",
    card=card_of(__doc__),
    scene="iiwa14-table",
    set=("avoidance.on=false", "limits.stall_guard=false"),
    steps=(UNSEEN, BOUND, UNREST, SEEN),
    challenge=CHALLENGE,
)

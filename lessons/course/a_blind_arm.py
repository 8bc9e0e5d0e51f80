"""A blind arm

An arm that measures only its joints is sent into a table: how hard does it press?

Minutes: 8
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
INTO = ((0.1, MoveTarget("position", (0.556, 0.0, 0.19))),)
SCALE = Control("limits.torque_scale", "Torque limit, factor", 0.12, 1.0, log=True)
CONTROLLER = Control("controller", "Controller", choices=("himpc", "tdeosf", "osf"))
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
    with time-delay estimation has no horizon and presses as hard, so MPC is not to blame. With half of
    $\bar M$ the arm presses half as hard. The ghost acts like a spring: for one centimetre of error it
    presses with 4 N, and no more.
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
    controls=(CONTROLLER, Control("M_bar_scale", "M̄, factor", 0.25, 1.0), STIFFNESS),
    plots=(FORCE, HAND, TORQUE),
)

BOUND = Step(
    title="Who limits the force?",
    text=r"""
    The motion is the same, but the bound of the torque (32f) is a quarter of the torque of the motors:

    $$\tau_{\min} \le \tau_0 + \sum_{s=0}^{j} \Delta\tau_{k+s} \le \tau_{\max}$$
    """,
    do="Halve K_P, and let the simulation continue. Does the arm press less, or only later?",
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
    The controller has no information about the table. At the end the arm must press on the table with at
    least 100 N, and at no time with more than 300 N.
    """,
    goals=(
        Claim("At the end the arm presses with 100 N.", Measure(FORCE, "last"), "at least", 100.0),
        Claim("The arm never presses with more than 300 N.", Measure(FORCE), "at most", 300.0),
    ),
    knobs=(SCALE, STIFFNESS),
    score=Score(Measure(FORCE), worst=300.0, best=180.0),
    solutions=(("limits.torque_scale=0.18",), ("limits.torque_scale=0.2",)),
    events=INTO,
    duration=2.2,
)

LESSON = Lesson(
    name="a-blind-arm",
    card=card_of(__doc__),
    scene="iiwa14-table",
    steps=(UNSEEN, BOUND, SEEN),
    challenge=CHALLENGE,
)

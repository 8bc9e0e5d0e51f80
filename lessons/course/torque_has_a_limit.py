"""Torque has a limit

When the motors do not have enough torque for all tasks, which task has an error?

Minutes: 8
You need: lesson "two-tasks"
"""

from __future__ import annotations

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/position", "mm")
Q1 = Signal("error/q1", "deg")
TORQUE = Signal("torque share", "%")
SCALE = Control("limits.torque_scale", "Torque limit, factor", 0.01, 1.0, log=True)
FRICTION = Control("plant.friction", "Friction of the joints, N·m", 0.0, 0.3)
SWING = "q1_amplitude_deg=-30"

ENOUGH = Step(
    title="Enough for all",
    text=r"""
    The hand follows its circle and joint 1 swings by −30°, one round in 8 s. Every torque must stay
    within its limit, now and over the whole horizon (32f):

    $$\tau_{\min} \le \tau_0 + \sum_{s=0}^{j} \Delta\tau_{k+s} \le \tau_{\max}$$

    The motors could give 4 N·m. The limit here is six per cent of this torque.
    """,
    do="Lower the limit until something changes. Which error changes first?",
    why=r"""
    The run needs nine tenths of the 0.24 N·m, and most of this torque is friction: without any friction the
    same motion needs a third of the 0.24 N·m, and with viscous friction only it needs half of the 0.24 N·m.
    A bound that is not active has no effect: with the full torque of the motors the errors are the same.
    """,
    prediction=Value(
        "What is the largest torque during the motion, as a share of the reduced limit?",
        Measure(TORQUE),
        low=1.0,
        high=100.0,
        factor=1.4,
    ),
    claims=(
        Claim(
            "The hand stays within 0.5 mm.",
            Measure(HAND),
            "at most",
            0.5,
            fails_with=("limits.torque_scale=0.03",),
            because="this torque is too little for level 1 alone, with the dry friction of the joints",
        ),
        Claim(
            "Joint 1 stays within 0.1°.",
            Measure(Q1),
            "at most",
            0.1,
            fails_with=("limits.torque_scale=0.04",),
            because="the torque is not enough for both tasks and the friction, and the hand comes first",
        ),
    ),
    set=(SWING, "limits.torque_scale=0.06"),
    duration=3.0,
    controls=(SCALE,),
    plots=(TORQUE, HAND, Q1),
)

SHORT = Step(
    title="A third less",
    text=r"""
    The limit is now four per cent of the torque, 0.16 N·m. This is not enough for both tasks and the dry
    friction of the joints, 0.05 to 0.1 N·m each. Every level is solved under the same bounds, level 1
    first; level 2 chooses among the torques that do not change the result of level 1 (34).
    """,
    do="Open the list of active bounds: at which level is the torque limit active? Then remove the friction.",
    why=r"""
    Level 2 has the error: joint 1 falls behind by half a degree while the error of the hand does not grow.
    This is due to the order. With joint 1 first the hand has the error, 1.6 mm, and the error of joint 1
    does not grow. An order helps where both tasks need the same scarce torque. If joint 1 swings to the
    other side, by 60°, only the motor of joint 1 has too little torque. The hand does not need this motor,
    so the order makes no difference. The torque is scarce because of friction, dry and viscous together:
    without dry friction both tasks together need 77 % of the available torque, and without any friction
    joint 1 does not fall behind.
    """,
    prediction=Choice(
        "Both tasks together need more torque than is available. The hand's largest error …",
        (
            Option("stays below a millimetre", high=1.0),
            Option("grows to some centimetres", low=10.0),
        ),
        Measure(HAND),
        tempting=1,
    ),
    claims=(
        Claim(
            "The hand stays within 0.5 mm.",
            Measure(HAND),
            "at most",
            0.5,
            fails_with=("order=q1,position",),
            because="then joint 1 has the higher priority",
        ),
        Claim(
            "Joint 1 falls behind by more than 0.3°.",
            Measure(Q1),
            "at least",
            0.3,
            fails_with=("limits.torque_scale=0.06",),
            because="then the torque is enough for both tasks",
        ),
        Claim(
            "The demanded torque never exceeds the limit.",
            Measure(TORQUE),
            "at most",
            100.01,
            fails_with=("controller=tdeosf",),
            because="TDEOSF does not use the bounds",
        ),
    ),
    set=(SWING, "limits.torque_scale=0.04"),
    duration=3.0,
    controls=(
        SCALE,
        Control("order", "Order", choices=("position,q1", "q1,position")),
        Control("q1_amplitude_deg", "Swing of joint 1, °", -30.0, 60.0),
        FRICTION,
        Control("controller", "Controller", choices=("himpc", "tdeosf")),
    ),
    plots=(TORQUE, HAND, Q1),
)

LESS = Step(
    title="Too little torque for one task",
    text=r"""
    The limit is three per cent, 0.12 N·m. Now even the circle by itself, together with the dry friction,
    needs more torque than that. Joint 1 swings to the other side, by 60°. The ghost has the task of joint 1
    switched off.
    """,
    do="Find the least torque with which the hand stays on its circle. How much is enough without friction?",
    why=r"""
    The hand leaves its circle: bounds rank above level 1. Without dry friction the circle by itself would
    need 0.07 N·m, and the hand would stay on it. The task of joint 1 does not increase the error of the
    hand: with joint 1 first the hand is off as far as with the hand first. In both orders joint 1's motor
    is at the same limit nearly all the time. The order holds at each tick. Over a run a second task may
    still lead the arm to poses in which the error of the hand is larger: with a swing of −30° the error of
    the hand is larger than the ghost's, 16 mm instead of 10. With this swing and joint 1 first the hand is
    off by 9 mm.
    """,
    prediction=Choice(
        "The ghost has no second task. How much larger is the error of the hand than the ghost's?",
        (
            Option("not larger: the hand gets all the torque", high=1.1),
            Option("about twice", 1.1, 3.0),
            Option("much larger", low=3.0),
        ),
        Measure(HAND, over_ghost=True),
        tempting=1,
    ),
    claims=(
        Claim(
            "The hand is off by more than 3 mm.",
            Measure(HAND),
            "at least",
            3.0,
            fails_with=("limits.torque_scale=0.04",),
            because="this torque is still enough for level 1",
        ),
        Claim(
            "The hand's largest error is at most 10 % above the ghost's.",
            Measure(HAND, over_ghost=True),
            "at most",
            1.1,
            fails_with=("limits.torque_scale=0.025",),
            because="then the robot has less torque than the ghost",
        ),
    ),
    set=("q1_amplitude_deg=60", "limits.torque_scale=0.03"),
    duration=3.0,
    ghost=Ghost("without joint 1's task", ("levels.q1.enabled=false",)),
    controls=(
        SCALE,
        Control("levels.q1.enabled", "Joint 1's task on", choices=(False, True)),
        Control("q1_amplitude_deg", "Swing of joint 1, °", -30.0, 60.0),
        FRICTION,
    ),
    plots=(TORQUE, HAND, Q1),
)

LESSON = Lesson(
    name="torque-has-a-limit",
    card=card_of(__doc__),
    scene="planar3-circle",
    steps=(ENOUGH, SHORT, LESS),
)

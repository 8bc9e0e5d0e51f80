"""Keeping clear

An arm must not touch a table and a post: is this requirement a task, a bound, or a filter?

Minutes: 10
You need: lesson "stopping-takes-distance"; lesson "a-blind-arm"
"""

from __future__ import annotations

from lessons.events import MoveTarget
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

HAND = Signal("error/position", "mm")
TILT = Signal("error/orientation", "deg")
HEIGHT = Signal("error/distance", "mm")
FORCE = Signal("contact_force", "N")
DISTANCE = Signal("distance", "mm")
LEAK = Signal("priority_leak", "m/s²")
INTO = ((0.1, MoveTarget("position", (0.556, 0.0, 0.19))),)
ABOVE = ((0.1, MoveTarget("position", (0.556, 0.0, 0.25))),)
PAST_THE_POST = ((0.1, MoveTarget("position", (0.4, -0.4, 0.4))),)
WITH_A_TASK = (
    'stack=[{"task":"position"},{"task":"plane_distance","name":"distance","offset":0.2},'
    '{"task":"orientation"},{"task":"posture"}]',
)
FIRST = "order=distance,position,orientation,posture"
ORDER = Control(
    "order",
    "Order",
    choices=("position,distance,orientation,posture", "distance,position,orientation,posture"),
)
ON = Control("avoidance.on", "Distances are kept", choices=(False, True))
CONTROLLER = Control("controller", "Controller", choices=("himpc", "himpc_filtered"))

BELOW = Step(
    title="A task below",
    text=r"""
    The hand is sent 1 cm into the table again. Level 2 is a task that keeps the hand's distance from
    the table's surface, $x = n^\top p - d$. Level 1 is the hand's position.
    """,
    do="Before you continue, put the distance first. Which task is not met now?",
    why=r"""
    Level 2 has no effect. The position fixes the hand's height, so no freedom is left for the distance, and
    the arm presses on the table as if there were no task of a distance. A task does not protect against a
    task of higher priority.
    """,
    prediction=Choice(
        "The task of the distance ranks right below the hand's position. At the end the arm presses with …",
        (
            Option("nothing: the hand stops above the table", high=1.0),
            Option("less than without that task", 1.0, 200.0),
            Option("more than 200 N, as without that task", low=200.0),
        ),
        Measure(FORCE, "last"),
        tempting=1,
    ),
    claims=(
        Claim(
            "At the end the arm presses on the table with more than 200 N.",
            Measure(FORCE, "last"),
            "at least",
            200.0,
            fails_with=(FIRST,),
            because="then the hand does not go down at all",
        ),
    ),
    set=WITH_A_TASK,
    events=INTO,
    duration=1.8,
    controls=(ORDER,),
    plots=(FORCE, HAND, HEIGHT),
)

FIRST_TASK = Step(
    title="The task ranks first",
    text=r"""
    Now the distance is level 1, and the hand's target is moved to 5 cm above the table: a place where the
    arm touches nothing. A task requires an equality, $x = x_d$. The task of level 1 holds the initial
    distance of 20 cm.
    """,
    do="Drag the target sideways, then up. In which directions can the hand still move?",
    why=r"""
    The hand stays where it is, 15 cm above a target that is safe. Safety requires an inequality, a minimum
    distance. A task fixes the whole direction: it also prevents motions that only make a sufficient distance
    larger. Besides, the task of level 1 refers to one frame and one plane only: it does not include the elbow
    and the post.
    """,
    claims=(
        Claim(
            "The hand stays more than 140 mm away from a target that is safe.",
            Measure(HAND, "last"),
            "at least",
            140.0,
            fails_with=("order=position,distance,orientation,posture",),
            because="then the hand goes to the target, and touches nothing",
        ),
        Claim(
            "The distance is kept to 1 mm.",
            Measure(HEIGHT),
            "at most",
            1.0,
            fails_with=("order=position,distance,orientation,posture",),
            because="then the position comes first",
        ),
    ),
    set=(*WITH_A_TASK, FIRST),
    events=ABOVE,
    duration=1.5,
    controls=(ORDER,),
    plots=(HAND, HEIGHT, DISTANCE),
)

INSIDE = Step(
    title="Above all levels",
    text=r"""
    For a distance $d$ between any two links, or a link and an object, the controller adds a row to the rows
    of torque and speed. The row bounds the speed at which $d$ shrinks,

    $$\nabla d^\top \dot q_{k+j} \ge -a\left(-t + \sqrt{t^2 + 2\,(d - d_s)/a}\right),$$

    by the speed from which the arm can still stop. Only the seven pairs that could reach $d_s$ soonest have
    rows, and each level is solved under these rows. The hand is sent to the other side of the post, and the
    elbow has to pass the post.
    """,
    do="Open the list of active bounds: which pairs are at their bound? Then put the orientation first.",
    why=r"""
    The bound applies to all levels, and the order decides which task has an error. The hand's position
    comes first: the hand reaches its target, and its orientation is off by 28°. With the orientation first
    the position has the error: then the hand stays 6 cm away. Where the bound is not active, it causes no
    error.
    """,
    prediction=Choice(
        "The post blocks the straight way. At the end the hand …",
        (
            Option("stops far away from its target", low=50.0),
            Option("has come near its target", 5.0, 50.0),
            Option("is at its target", high=5.0),
        ),
        Measure(HAND, "last"),
        tempting=0,
    ),
    claims=(
        Claim(
            "Nothing is touched.",
            Measure(FORCE),
            "at most",
            0.0,
            fails_with=("avoidance.on=false",),
            because="the arm hits the post",
        ),
        Claim(
            "The hand gets to within 5 mm of its target.",
            Measure(HAND, "last"),
            "at most",
            5.0,
            fails_with=("controller=himpc_filtered",),
            because="a filter behind the levels does not use the order of the tasks",
        ),
        Claim(
            "The orientation is off by more than 20°.",
            Measure(TILT, "last"),
            "at least",
            20.0,
            fails_with=("order=orientation,position,posture",),
            because="then the position has the error",
        ),
    ),
    set=("avoidance.on=true",),
    events=PAST_THE_POST,
    duration=2.4,
    controls=(
        ON,
        Control("order", "Order", choices=("position,orientation,posture", "orientation,position,posture")),
    ),
    plots=(DISTANCE, HAND, TILT),
)

BEHIND = Step(
    title="Behind all levels",
    text=r"""
    In many robots the controller itself uses no distances, and a safety filter follows the controller. This
    filter is a QP that changes the torque as little as possible,

    $$\min_\tau \lVert \bar M^{-1} (\tau - \tau_{\mathrm{nom}}) \rVert^2,$$

    within the bounds of the torque and under the same rows of distances, but only for the next step. The
    ghost has its rows inside the hierarchy.
    """,
    do="Switch off the orientation and the posture. How near does the hand come now?",
    why=r"""
    With the filter, too, the arm touches nothing. But the filter has no rows of speed: with other drags a
    joint exceeds its limit, which the rows inside the hierarchy prevent. And it does not use the order of
    the tasks. The tasks of orientation and posture move the elbow towards the post, the filter changes the
    sum of all torques as little as possible, and the hand has the error: it stops 27 cm before its target.
    The lower levels are to blame: with both of them switched off the hand is 5 cm away at that time, and
    still comes closer. One of these two levels is enough to hold the hand back: if only the posture is
    switched off, 23 cm are left, and if only the orientation is switched off, 19 cm are left. An order of
    tasks does not hold if the bounds are applied after it.
    """,
    prediction=Choice(
        "The rows of distances are the same, but a filter after all levels imposes them. At the end the "
        "hand …",
        (
            Option("is at its target, as the ghost's hand is", high=5.0),
            Option("is a few centimetres away", 5.0, 100.0),
            Option("is a quarter of a metre away", low=200.0),
        ),
        Measure(HAND, "last"),
        tempting=0,
    ),
    claims=(
        Claim(
            "Nothing is touched.",
            Measure(FORCE),
            "at most",
            0.0,
            fails_with=("avoidance.on=false",),
            because="then there is no filter",
        ),
        Claim(
            "The hand stays more than 200 mm away from its target.",
            Measure(HAND, "last"),
            "at least",
            200.0,
            fails_with=("controller=himpc",),
            because="inside the hierarchy the hand comes first",
        ),
        Claim(
            "The filter changes the accelerations of higher levels by more than 1 m/s².",
            Measure(LEAK),
            "at least",
            1.0,
            fails_with=("controller=himpc",),
            because="inside the hierarchy no level changes the levels above it (33)",
        ),
    ),
    set=("avoidance.on=true", "controller=himpc_filtered"),
    events=PAST_THE_POST,
    duration=2.4,
    ghost=Ghost("himpc, rows inside", ("controller=himpc",)),
    controls=(
        CONTROLLER,
        ON,
        Control("levels.orientation.enabled", "Orientation", choices=(False, True)),
        Control("levels.posture.enabled", "Posture", choices=(False, True)),
    ),
    plots=(DISTANCE, HAND, LEAK),
)

LESSON = Lesson(
    name="keeping-clear",
    card=card_of(__doc__),
    scene="iiwa14-table",
    set=("avoidance.on=false", "limits.stall_guard=false"),
    steps=(BELOW, FIRST_TASK, INSIDE, BEHIND),
)

"""Stopping takes distance

A controller looks 5 ms ahead, and a joint reaches the end of its range: is the horizon long enough?

Minutes: 10
You need: lesson "torque-has-a-limit"; braking distance
"""

from __future__ import annotations

from lessons.events import MoveTarget
from lessons.teaching.challenge import Challenge, Score
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

RANGE = Signal("position share", "%")
TORQUE = Signal("torque share", "%")
SPEED = Signal("v", "deg/s", column=1)
STOP = Signal("deceleration to stop", "rad/s²")
LATE_SPEED = Signal("speed within 5° of an end", "deg/s")
JOINT_2 = Signal("q", "deg", column=1)
PLOTS = (JOINT_2, SPEED, TORQUE)
# Joint 2 ends at 150°; its target lies 22° beyond that.
BEYOND = ((0.1, MoveTarget("posture", (0.0, 3.0, -1.57))),)
ONLY_JOINTS = ("levels.position.enabled=false", "levels.orientation.enabled=false")
# The joints have no end stops here, so that the plot shows how far a joint overruns its range.
NO_STOPS = "plant.joint_stops=false"
MODE = Control("limits.position", "Position limits", choices=("paper", "viability", "off"))
N = Control("horizon", "N", 1, 40)
APPROACH = Control("limits.velocity_approach", "Approach rate to speed bounds, 1/s", 5.0, 200.0, log=True)

PRINTED = Step(
    title="Five milliseconds",
    text=r"""
    Joint 2 may turn to 150°. Its target lies 22° beyond this limit, and the joint arrives at 57°/s. This
    arm has no end stops: only the controller keeps a joint in its range. The paper bounds the predicted
    positions (32d),

    $$q_{\min} \le q_{k+j+1} \le q_{\max}, \qquad j = 0 \dots N-1,$$

    with $N = 5$ steps of a millisecond. In 5 ms the joint turns by 0.3°. The limit affects the plan only
    from this distance on.
    """,
    do="Watch the torque of joint 2 when the joint reaches the limit.",
    why=r"""
    To stop from 57°/s within 0.3° takes a deceleration of about 100 rad/s². With all its torque the motor
    reaches 35 to 38 rad/s², and the joint overruns its range by 0.6°. Many of the QPs have no solution, and
    a fallback takes over. The lack of torque explains most of the overrun: at 15°/s, where 26 rad/s² are
    enough, the joint overruns by 0.03° only. But QPs have no solution in that case either, because the rows
    on the position contradict the rows on the change of speed: without the rows on the change of speed
    (`limits.velocity_approach=0`) only seven such QPs are left. The rows on speed add 0.07° to the overrun:
    without them the overrun is still 0.57°. With three times the torque, in the bounds and in the motors,
    0.2° is left, and the rows on speed cause half of it: without them 0.1° is left. The row on the position
    is correct, but it takes effect too late.
    """,
    prediction=Choice(
        "The joint arrives at 57°/s, and the controller plans 5 ms ahead. How hard does the joint brake?",
        (
            Option("gently, because the limit is in its horizon", high=50.0),
            Option("firmly", 50.0, 95.0),
            Option("with all the torque it has", low=95.0),
        ),
        Measure(TORQUE),
        tempting=0,
    ),
    claims=(
        Claim(
            "The joint overruns its range.",
            Measure(RANGE),
            "at least",
            100.1,
            fails_with=("limits.position=viability",),
            because="with this bound the joint starts to brake in time",
        ),
        Claim(
            "More than twenty QPs have no solution.",
            Measure(Signal("unsolved"), "sum"),
            "at least",
            20.0,
            fails_with=("horizon=20",),
            because="with 20 ms every QP has a solution",
        ),
    ),
    set=("limits.position=paper",),
    events=BEYOND,
    duration=2.2,
    controls=(MODE, N),
    plots=PLOTS,
)

LONGER = Step(
    title="Look further?",
    text=r"""
    The rows are the same, with $N = 20$. Braking from $v$ with deceleration $a$ takes the time $v/a$ and
    the distance $v^2/2a$. With $v = 1$ rad/s and the 20 rad/s² for which this arm is rated, these are 50 ms
    and 1.4°.
    """,
    do="Raise N to 40. Which horizon is needed to brake gently? How long does a tick then take to compute?",
    why=r"""
    The joint just stays within its range, with full torque: 20 ms are enough for an emergency stop, not for
    a gentle one. A horizon that covers the whole braking distance has 50 steps.
    """,
    claims=(
        Claim(
            "The joint stays within its range.",
            Measure(RANGE),
            "at most",
            100.0,
            fails_with=("horizon=5",),
            because="5 ms are too short to stop in",
        ),
        Claim(
            "The joint still brakes with more than 90 % of its torque.",
            Measure(TORQUE),
            "at least",
            90.0,
            fails_with=("limits.position=viability",),
            because="with the bound on speed the joint brakes over the whole distance",
        ),
    ),
    set=("limits.position=paper", "horizon=20"),
    events=BEYOND,
    duration=2.2,
    controls=(MODE, N),
    plots=PLOTS,
)

VIABLE = Step(
    title="A speed from which the joint can stop",
    text=r"""
    Instead of the position, bound the speed. At every distance from the limit, only speeds are allowed from
    which the joint can still stop:

    $$\dot q \le a\left(-t + \sqrt{t^2 + 2\,(q_s - q)/a}\right)$$

    A joint that continues at this speed for a time $t$ and then brakes with $a = 20$ rad/s² stops at $q_s$.
    Such a state is called viable: a motion exists that keeps the limit. With immediate braking and an exact
    model, $t = T_s$ and $q_s = q_{\max}$ would be enough. But the rows on speed delay the braking: in a
    second the speed may change by at most 15 times the difference between the speed and its bound. So $t =
    T_s + 5/15$ s $= 0.33$ s. Our model is estimated, so the joint brakes late, and then harder than with $a$.
    To allow for this late braking, $q_s$ lies 0.4° before the limit. Beyond $q_s$ the joint must come back:
    its speed in °/s is five times its distance from $q_s$ in degrees. Again $N = 5$.
    """,
    do="Raise the approach rate to 60 and 200 1/s. What improves, and how large is the torque?",
    why=r"""
    Now the bound on the next step already contains the whole braking distance. At 5° before the limit $t =
    T_s$ would allow 106°/s, $t = 0.33$ s only 13.5°/s. The joint turns with 18°/s: it follows the falling
    bound a little late. The rows on speed are the reason, not the estimate: with twice the $\bar M$ the
    joint also turns with 18°/s. Without the rows on speed ($t = T_s$) the delay of the estimate has a
    visible effect: the joint brakes with 28 instead of 20 rad/s² and passes $q_s$ by 0.002°. With twice the
    $\bar M$ it brakes with 24 rad/s². With 0.3 times the $\bar M$ it needs all the torque and passes $q_s$ by
    0.03°. So 0.4° are more than enough for the estimate. A stop before the limit with constant deceleration
    would never take more than 1.5 of the 20 rad/s², and every QP has a solution. The disadvantage is time:
    the joint moves slowly over the last degrees. If a limit lies beyond a short horizon, the bounds within
    the horizon must take the limit into account. The bound on speed is the default of this lab, and a
    deliberate departure from (32d).
    """,
    prediction=Choice(
        "With a horizon of 5 ms and the bound on speed, the largest torque is …",
        (
            Option("all the available torque, as before", low=95.0),
            Option("about half", 30.0, 95.0),
            Option("less than a third", high=30.0),
        ),
        Measure(TORQUE),
        tempting=1,
    ),
    claims=(
        Claim(
            "The joint stays within its range.",
            Measure(RANGE),
            "at most",
            100.0,
            fails_with=("limits.position=paper",),
            because="5 ms are too short to stop in",
        ),
        Claim(
            "The joint needs less than 30 % of its torque.",
            Measure(TORQUE),
            "at most",
            30.0,
            fails_with=("limits.position=paper",),
            because="the late stop takes all the torque",
        ),
        Claim(
            "The deceleration needed to stop before the limit is never more than 2 rad/s².",
            Measure(STOP),
            "at most",
            2.0,
            fails_with=("limits.velocity_approach=0",),
            because="with t = Tₛ a stop takes 16 of the 20 rad/s²",
        ),
        Claim(
            "Within 5° of the limit no joint moves at more than 20°/s.",
            Measure(LATE_SPEED),
            "at most",
            20.0,
            fails_with=("limits.velocity_approach=0",),
            because="t = Tₛ allows 106°/s there",
        ),
        Claim(
            "Every QP has a solution.",
            Measure(Signal("unsolved"), "sum"),
            "at most",
            0.0,
            fails_with=("limits.position=paper",),
            because="near the limit the printed rows contradict each other",
        ),
    ),
    events=BEYOND,
    duration=2.2,
    controls=(MODE, APPROACH, Control("limits.velocity_scale", "Speed limit, factor", 0.1, 3.0)),
    plots=PLOTS,
)

CHALLENGE = Challenge(
    text=r"""
    Use the printed rows only. Bring joint 2 to 149° or more without overrunning its range, and brake with
    less than 90 % of the torque.
    """,
    goals=(
        Claim("Joint 2 gets to 149°.", Measure(JOINT_2, "last"), "at least", 149.0),
        Claim("The joint stays within its range.", Measure(RANGE), "at most", 100.0),
        Claim("The joint needs less than 90 % of its torque.", Measure(TORQUE), "at most", 90.0),
    ),
    knobs=(N, Control("limits.velocity_scale", "Speed limit, factor", 0.1, 1.0)),
    score=Score(Measure(TORQUE), worst=90.0, best=30.0),
    solutions=(("horizon=30",), ("horizon=30", "limits.velocity_scale=0.5")),
    set=("limits.position=paper",),
    events=BEYOND,
    duration=2.6,
)

LESSON = Lesson(
    name="stopping-takes-distance",
    card=card_of(__doc__),
    scene="planar3-hold",
    set=("avoidance.on=false", "limits.stall_guard=false", *ONLY_JOINTS, NO_STOPS),
    steps=(PRINTED, LONGER, VIABLE),
    challenge=CHALLENGE,
)

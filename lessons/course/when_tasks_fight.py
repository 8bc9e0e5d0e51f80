"""When tasks fight

Each of two tasks can be fulfilled alone, but not both together: why do some controllers fail then?

Minutes: 10
You need: lesson "two-tasks"; the null space of a matrix
"""

from __future__ import annotations

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

HAND = Signal("error/position", "mm")
Q1 = Signal("error/q1", "deg")
TORQUE = Signal("torque share", "%")
SPEED = Signal("speed share", "%")
CONTROLLER = Control("controller", "Controller", choices=("himpc", "osf", "tdeosf", "hqp"))
AMPLITUDE = Control("q1_amplitude_deg", "Swing of joint 1, °", -120.0, 20.0)

PROJECTION = Step(
    title="Project and invert",
    text=r"""
    The classical method for priorities projects task 2 into the null space of task 1, $J_{2|1} = J_2 P_1$,
    and computes the force that task 2 needs there. This requires the inverse of $J_{2|1} M^{-1}
    J_{2|1}^\top$. Here the hand follows its circle and joint 1 swings to −120°, beyond what the circle
    allows. From 1.3 s on links 2 and 3 come into line. When they are in line, they can no longer compensate
    for joint 1, so any motion of joint 1 moves the hand: $J_{2|1}$ vanishes. The controller is OSF, with a
    model that is 20 % too light. Here the demanded torque is only compared with the limit of the motors; the
    limit is not enforced.
    """,
    do="While the arm moves, switch to HIMPC before the conflict, and back.",
    why=r"""
    A division by almost zero gives a very large number: the demanded torque passes a thousand times the
    limit and the arm goes out of control. Neither Jacobian alone is singular there. The algorithm creates
    the singularity, which is therefore called algorithmic.
    """,
    prediction=Choice(
        "When the tasks start to conflict, the torque that OSF demands is at most …",
        (
            Option("within the limit: task 2 gives way", high=100.0),
            Option("up to ten times the limit", 100.0, 1000.0),
            Option("beyond a hundred times the limit", low=10000.0),
        ),
        Measure(TORQUE),
        tempting=0,
    ),
    claims=(
        Claim(
            "The demand exceeds a hundred times the torque limit.",
            Measure(TORQUE),
            "at least",
            10000.0,
            fails_with=("controller=himpc",),
            because="HIMPC has bounds in its QPs; without bounds it demands a hundred times the limit, too",
        ),
        Claim(
            "A joint turns at more than twenty times its speed limit: control is lost.",
            Measure(SPEED),
            "at least",
            2000.0,
            fails_with=("q1_amplitude_deg=20",),
            because="a swing of 20° does not conflict with the circle",
        ),
        Claim(
            "Up to 1.3 s, while links 2 and 3 are still at an angle, the demand stays within the limit.",
            Measure(TORQUE, until=1.3),
            "at most",
            100.0,
            fails_with=("q1_amplitude_deg=-170",),
            because="with a larger swing links 2 and 3 come into line sooner",
        ),
    ),
    set=("controller=osf",),
    duration=2.0,
    controls=(CONTROLLER, AMPLITUDE),
    plots=(TORQUE, SPEED, HAND),
)

BETTER_MODEL = Step(
    title="Would a better model help?",
    text=r"""
    TDEOSF replaces the model by time-delay estimation, as HIMPC does, but it keeps the projection and its
    inverse, $(J_{2|1} \bar M^{-1} J_{2|1}^\top)^{-1}$. Until the conflict it is far more accurate than OSF.
    """,
    do="Let joint 1 swing by 20° only and compare OSF with TDEOSF.",
    why=r"""
    TDEOSF describes the arm better and fails at the same place, and so does OSF with an exact model. The
    model does not explain the failure. The inverse demands more than the arm can do and contains no bound.
    With a damped inverse TDEOSF keeps control, with less than four times the speed limit. With a damped
    inverse OSF does not: a joint passes six times its limit. A controller without any inverse loses control
    as well if nothing bounds it: HIMPC does, with all its bounds off.
    """,
    prediction=Choice(
        "The dynamics are estimated instead of taken from a wrong model. At the conflict the arm …",
        (
            Option("stays under control, since the model is right", high=500.0),
            Option("goes out of control as before", low=500.0),
        ),
        Measure(SPEED),
        tempting=0,
    ),
    claims=(
        Claim(
            "Up to 1 s the hand is within 0.3 mm.",
            Measure(HAND, until=1.0),
            "at most",
            0.3,
            fails_with=("controller=osf",),
            because="OSF's model has no friction",
        ),
        Claim(
            "Then a joint passes twenty times its speed limit.",
            Measure(SPEED),
            "at least",
            2000.0,
            fails_with=("controller=himpc",),
            because="HIMPC has bounds in its QPs",
        ),
    ),
    set=("controller=tdeosf",),
    duration=2.0,
    controls=(CONTROLLER, AMPLITUDE),
    plots=(TORQUE, SPEED, HAND),
)

EQUALITY = Step(
    title="A constraint instead of a projection",
    text=r"""
    HIMPC never forms $J_{2|1}$. Level 2 is a problem of its own with the equality (34g), which keeps the
    result of level 1. If nothing is left for level 2, that problem is still solvable: $\Delta\tau_2 =
    \Delta\tau_1$ satisfies all constraints (Theorem 2), and its Hessian is positive definite because of $R$
    (Lemma 1).
    """,
    do="Watch joint 1 at 1.4 s and again when it comes back.",
    why=r"""
    Level 2 has a target that it cannot reach. It moves joint 1 to the limit that level 1 allows, where links
    2 and 3 are in line. There the arm does not come to rest: from 2 s on joint 3 swings about this limit, to
    and fro with 94°/s, a little more than once a second. This continues until the reference of joint 1 comes
    back. A strict order does not prevent such oscillations, but it does not sustain them: in a weighted sum
    with $Q_2 = 0.01$ joint 3 swings as well, with up to 73°/s. The estimation does not sustain
    the swing either: with twice the $\bar M$ it swings as before. With our weights the horizon of level 2
    sustains the swing: with $N = 1$ at level 2 alone the swing decays to an oscillation of 12°/s, with $N =
    1$ at level 1 alone it swings as before. Another weight changes this result. With $R_2 = 10^5$ the swing
    slows down to 58°/s and does not need the horizon: with $N = 1$ and $R_2 = 10^5$ joint 3 continues to
    swing with 62°/s. In spite of the swing, torque and speed stay within their bounds, and the hand stays
    on its circle. The equality (34g) alone is not enough for this. The bounds are needed, too: without
    those on speed and position every motor comes to its limit and the hand is off by 11 mm, and without any
    bound the arm goes out of control as with a projection.
    """,
    claims=(
        Claim(
            "The hand stays within 1.5 mm of its circle.",
            Measure(HAND),
            "at most",
            1.5,
            fails_with=("controller=osf",),
            because="OSF is off by millimetres, and then loses control",
        ),
        Claim(
            "The demanded torque never exceeds its limit.",
            Measure(TORQUE),
            "at most",
            100.0,
            fails_with=("controller=tdeosf",),
            because="an inverse near a singularity demands torque without any bound",
        ),
        Claim(
            "No joint exceeds its speed limit by more than 5 %.",
            Measure(SPEED),
            "at most",
            105.0,
            fails_with=("controller=hqp",),
            because="HQP has rows on torque only, none on speed",
        ),
        Claim(
            "After 2.5 s, joint 3 swings: its speed varies by more than 150°/s.",
            Measure(Signal("v", "deg/s", column=2), "range", after=2.5),
            "at least",
            150.0,
            fails_with=("q1_amplitude_deg=20",),
            because="without a conflict the arm does not reach the limit about which joint 3 swings",
        ),
        Claim(
            "Joint 3 swings about the straight pose: from 1.75 s on it is within 20° of straight.",
            Measure(Signal("q", "deg", column=2), after=1.75),
            "at most",
            20.0,
            fails_with=("q1_amplitude_deg=20",),
            because="with this swing the arm does not become straight",
        ),
    ),
    duration=5.0,
    controls=(CONTROLLER, AMPLITUDE),
    plots=(Signal("v", "deg/s", column=2), TORQUE, HAND, Q1),
)

LESSON = Lesson(
    name="when-tasks-fight",
    card=card_of(__doc__),
    scene="planar3-conflict",
    steps=(PROJECTION, BETTER_MODEL, EQUALITY),
)

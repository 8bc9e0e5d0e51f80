"""One task under MPC

A hand is pushed and released: on which curve does it return, and what determines this curve?

Minutes: 10
You need: a mass on a spring with a damper
"""

from __future__ import annotations

from lessons.events import Push
from lessons.teaching.challenge import Challenge, Score
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Sketch

HAND = Signal("error/position", "mm")
HIT = ((0.1, Push("joint_3", force=(10.0, 0.0, 0.0), seconds=0.2)),)
ONLY_THE_HAND = ("levels.orientation.enabled=false", "levels.posture.enabled=false")

K_P = Control("tasks.position.K_p", "K_P, 1/s²", 1.0, 400.0, log=True)
K_V = Control("tasks.position.K_v", "K_V, 1/s", 1.0, 60.0)

SPRING = Step(
    title="The motion of a spring",
    text=r"""
    The arm has one task: its hand stays on the target. Equation (4) of the paper defines the desired motion
    of the error $\tilde x = x - x_d$:

    $$\ddot{\tilde x} + K_V \dot{\tilde x} + K_P \tilde x = 0$$

    This is the motion of a mass on a spring $K_P$ with a damper $K_V$. Here $K_P = 100$ and $K_V = 20 =
    2\sqrt{K_P}$. At 0.1 s the forearm is pushed with 10 N for 0.2 s.
    """,
    do="Push the arm yourself, wherever you like.",
    why=r"""
    When the push begins, the hand moves off its target. When the push ends, the hand moves off to the other
    side, because by then the torques had changed so as to push back. Half a second later the hand is back
    on its target, and it has not swung: with $K_V = 2\sqrt{K_P}$ the desired motion is critically damped.
    There is no spring in the arm. The controller looks for torques that make (4) true.
    """,
    prediction=Sketch(
        "Draw how far the hand is from its target, in mm. The push lasts from 0.1 s to 0.3 s.",
        HAND,
        low=0.0,
        high=6.0,
        until=1.2,
    ),
    claims=(
        Claim(
            "0.6 s after the push has ended the hand is back within half a millimetre.",
            Measure(HAND, after=0.9),
            "at most",
            0.5,
            fails_with=("tasks.position.K_v=2",),
            because="with a tenth of the damping it still swings",
        ),
    ),
    events=HIT,
    duration=1.5,
    controls=(K_V, K_P),
    plots=(HAND,),
)

DAMPER = Step(
    title="Take the damper away",
    text=r"""
    Now $K_V = 2$, a tenth of the old value. Equation (4) has become a weakly damped oscillator with $\omega
    = \sqrt{K_P} = 10$ rad/s, thus a period of 0.63 s. The arm, its motors and its links are the same as
    before.
    """,
    do="Look for the smallest K_V without a swing to the other side. Then double K_P and look again.",
    why=r"""
    The hand swings like the oscillator of (4), although the arm contains no spring. Here the gains describe
    a motion, not a torque.
    """,
    claims=(
        Claim(
            "From 1 s on the hand is still swinging: 4 mm RMS.",
            Measure(HAND, "rms", after=1.0),
            "at least",
            4.0,
            fails_with=("tasks.position.K_v=20",),
            because="with critical damping the hand is at rest by then",
        ),
        Claim(
            "The hand swings to both sides of its target: after 0.5 s by 10 mm in x from end to end.",
            Measure(Signal("error/position", "mm", column=0), "range", after=0.5),
            "at least",
            10.0,
            fails_with=("tasks.position.K_v=20",),
            because="there is no second swing",
        ),
    ),
    set=("tasks.position.K_v=2",),
    events=HIT,
    duration=1.5,
    controls=(K_V, K_P),
    plots=(HAND, Signal("error/position", "mm", column=0)),
)

PRICE = Step(
    title="The weight on changes of torque",
    text=r"""
    Every millisecond the controller plans $N = 5$ steps ahead and minimises (31), summed over these steps:

    $$\lVert e \rVert_Q^2 + \lVert \Delta\tau \rVert_R^2, \qquad e = \ddot{\tilde x} + K_V
    \dot{\tilde x} + K_P \tilde x \quad (28)$$

    $Q = 200$ is the weight on deviations from the desired motion, $R = 10$ the weight on *changes* of the
    torque. Now $R$ is 1000, a hundred times as much.
    """,
    do="Raise R further. From which value on can you see a difference?",
    why=r"""
    Almost nothing happens. The torque that holds the arm costs nothing; only its change from one
    millisecond to the next has a cost. A small change has a large effect: $e$ changes by $J \bar M^{-1}
    \Delta\tau$ with $\bar M^{-1} = 30$ here, so that $Q \lVert J \bar M^{-1} \Delta\tau \rVert^2$ outweighs
    $R$ by far. Only around $R = 10^5$ do both terms count equally.
    """,
    prediction=Choice(
        "R is a hundred times larger. How does the largest error of the same push change?",
        (
            Option("by less than 10 %", high=1.1),
            Option("it about doubles", 1.1, 4.0),
            Option("it grows tenfold", low=4.0),
        ),
        Measure(HAND, over_ghost=True),
        tempting=2,
    ),
    claims=(
        Claim(
            "A hundredfold R makes the largest error at most 5 % larger.",
            Measure(HAND, over_ghost=True),
            "at most",
            1.05,
            fails_with=("levels.position.R=1e5",),
            because="then changes of torque cost so much that the hand follows late",
        ),
    ),
    set=("levels.position.R=1000",),
    events=HIT,
    duration=1.0,
    ghost=Ghost("R = 10", ("levels.position.R=10",)),
    controls=(
        Control("levels.position.R", "R", 0.1, 1e6, log=True),
        Control("levels.position.Q", "Q", 1.0, 1000.0, log=True),
    ),
    plots=(HAND, Signal("delta_tau", "N·m")),
)

FREE = Step(
    title="A motion without a task",
    text=r"""
    The hand has two coordinates and the arm three joints: no task controls the remaining direction of
    motion. $R$ weighs changes of torque, so in that direction the torque does not change, as long as no
    bound changes it. The middle link gets a short push, 10 N for 0.2 s, and the last level, `damping`, is
    switched off.
    """,
    do="Switch the speed limits off and push again: which way does the elbow move? Then switch damping on.",
    why=r"""
    No task stops the motion in that direction, so the elbow still moves when the hand has long been on its
    target. A bound determines the direction in which the elbow moves. The push drives joint 2 to its speed
    limit, and the torques change to hold this speed. When the push ends, the part of the torques along the
    free motion stays as it is, and this part reverses joint 2. 0.2 s later joint 2 turns with 80°/s in the
    opposite direction. Without speed limits joint 2 continues in the direction of the push, with more than
    300°/s. It reverses only 0.75 s after the push. At that moment the held hand allows no further motion: the
    last link lies on the line from joint 1 to the hand. A last level with the task $\ddot q + K_V \dot q = 0$
    brings the elbow to rest, with hardly any effect on the hand.
    """,
    prediction=Choice(
        "The hand is held. What does the elbow do after the push?",
        (
            Option("it moves a little and stops", high=30.0),
            Option("it coasts slowly on", 30.0, 75.0),
            Option("it gets faster until it reaches its speed limit", low=75.0),
        ),
        Measure(Signal("speed share", "%")),
        tempting=0,
    ),
    claims=(
        Claim(
            "The elbow reaches at least three quarters of its speed limit.",
            Measure(Signal("speed share", "%")),
            "at least",
            75.0,
            fails_with=("damping=true",),
            because="the last level brings the elbow to rest",
        ),
    ),
    set=("damping=false",),
    events=((0.1, Push("joint_2", force=(0.0, 10.0, 0.0), seconds=0.2)),),
    duration=1.5,
    controls=(
        Control("limits.velocity", "Speed limits on", choices=(False, True)),
        Control("damping", "Damp what no level controls", choices=(False, True)),
    ),
    plots=(Signal("speed share", "%"), Signal("v", "deg/s", column=1), HAND),
)

CHALLENGE = Challenge(
    text=r"""
    The push is the same. Keep the hand within 3 mm of its target all the time, and bring it back within 0.5
    mm at 0.6 s, 0.3 s after the push has ended.
    """,
    goals=(
        Claim("The hand stays within 3 mm.", Measure(HAND), "at most", 3.0),
        Claim("From 0.6 s on the hand is within 0.5 mm.", Measure(HAND, after=0.6), "at most", 0.5),
    ),
    knobs=(K_P, K_V, Control("levels.position.R", "R", 0.1, 1e6, log=True)),
    score=Score(Measure(HAND, "rms"), worst=1.5, best=0.7),
    solutions=(
        ("tasks.position.K_p=200", "tasks.position.K_v=28"),
        ("tasks.position.K_p=400", "tasks.position.K_v=40"),
    ),
    set=("tasks.position.K_v=5",),
    events=HIT,
    duration=1.0,
)

LESSON = Lesson(
    name="one-task",
    card=card_of(__doc__),
    scene="planar3-hold",
    set=("avoidance.on=false", "limits.stall_guard=false", *ONLY_THE_HAND),
    steps=(SPRING, DAMPER, PRICE, FREE),
    challenge=CHALLENGE,
)

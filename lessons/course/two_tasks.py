"""Two tasks, one arm

Two tasks cannot both be fulfilled: is it enough to weigh them, or must one of them rank first?

Minutes: 10
You need: lesson "one-task"; Jacobians
"""

from __future__ import annotations

from lessons.teaching.challenge import Challenge, Score
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

HAND = Signal("error/position", "mm")
Q1 = Signal("error/q1", "deg")
SECONDS = 4.0
PLOTS = (HAND, Q1)

CONTROLLER = Control("controller", "Controller", choices=("himpc", "weighted"))
WEIGHT = Control("levels.q1.Q", "Q of level 2", 1e-5, 1000.0, log=True)
SWING = Control("q1_amplitude_deg", "Swing of joint 1, °", -120.0, 60.0)

BOTH = Step(
    title="Enough for both",
    text=r"""
    Level 1: the hand follows a circle, two coordinates. Level 2: joint 1 swings by 20°, one coordinate. The
    three joints are exactly enough for the three coordinates.
    """,
    do="Let joint 1 swing further, degree by degree, until one of the errors grows. Which one is it?",
    why=r"""
    As long as all tasks can be fulfilled together, priorities have hardly any effect: the ghost has none,
    only equal weights. Priorities matter where a bound limits one of the tasks: see lesson *Torque has a
    limit*.
    """,
    claims=(
        Claim(
            "The hand stays within 1 mm of its circle.",
            Measure(HAND),
            "at most",
            1.0,
            fails_with=("controller=osf",),
            because="OSF's model has no friction",
        ),
        Claim(
            "Joint 1 stays within 1° of its reference.",
            Measure(Q1),
            "at most",
            1.0,
            fails_with=("q1_amplitude_deg=-120",),
            because="with such a large swing of joint 1, the links cannot reach the circle",
        ),
        Claim(
            "With priorities the error of the hand exceeds the error with equal weights by at most 5 %.",
            Measure(HAND, "rms", over_ghost=True),
            "at most",
            1.05,
            fails_with=("controller=weighted", "q1_amplitude_deg=-120"),
            because="with weights joint 1 increases the error of the hand as soon as the two tasks conflict",
        ),
    ),
    set=("q1_amplitude_deg=20",),
    duration=2.5,
    ghost=Ghost("weighted, Q₁ = Q₂", ("controller=weighted",)),
    controls=(SWING,),
    plots=PLOTS,
)

WEIGHTED = Step(
    title="Weigh them",
    text=r"""
    Now the target of joint 1 swings to −120° and back. From there the links cannot reach the circle. The
    controller puts both tasks into one cost with equal weights, $Q_1 = Q_2 = 200$:

    $$\min_{\Delta\tau} \; \lVert e_1 \rVert_{Q_1}^2 + \lVert e_2 \rVert_{Q_2}^2 + \lVert \Delta\tau
    \rVert_R^2$$
    """,
    do="Make Q of level 2 smaller until the hand is on its circle. How large is the error of joint 1 then?",
    why=r"""
    A sum is a compromise. The sum weighs $e$, and at rest $e = K_P \tilde x$. A metre of the hand counts
    200 m/s², and a radian of joint 1 counts 50 rad/s². So the gains act as weights, too. Both tasks have
    errors, and the hand leaves its circle by a quarter of a metre. The units do not determine the right
    weights.
    """,
    prediction=Choice(
        "Equal weights for hand and joint 1: how far from its circle does the hand get?",
        (
            Option("less than 1 mm", high=1.0),
            Option("about a centimetre", 1.0, 50.0),
            Option("more than 10 cm", low=100.0),
        ),
        Measure(HAND),
        tempting=1,
    ),
    claims=(
        Claim(
            "The hand is off by more than 10 cm.",
            Measure(HAND),
            "at least",
            100.0,
            fails_with=("controller=himpc",),
            because="then the hand has the higher priority",
        ),
        Claim(
            "The error of the hand exceeds 20 cm.",
            Measure(HAND),
            "at least",
            200.0,
            fails_with=("tasks.q1.K_p=5", "tasks.q1.K_v=1.6"),
            because="with a tenth of the K_P of joint 1, its error counts a tenth, although Q is the same",
        ),
    ),
    set=("controller=weighted",),
    duration=SECONDS,
    ghost=Ghost("himpc: strict priorities", ("controller=himpc",)),
    controls=(CONTROLLER, WEIGHT),
    plots=PLOTS,
)

STRICT = Step(
    title="Rank them",
    text=r"""
    HIMPC solves one problem per level. The second level may choose among the torques that do not change the
    result of the first. This is the equality (33):

    $$\hat J_p \bar M^{-1} \Delta\tau_p^* = \hat J_p \bar M^{-1} \Delta\tau_i, \qquad p < i$$

    Level 2 uses the motions that are left. The ghost is the weighted controller.
    """,
    do="Set Q of level 2 to 1000. Does the error of the hand change? And with the weighted controller?",
    why=r"""
    Joint 1 has the error: it goes only as far as the circle allows. The hand keeps its circle to a
    millimetre, and with $Q_2 = 1000$ it does so as well: a large weight of level 2 does not increase the
    error of the hand. Without level 2 the hand is off by 0.2 mm only. With level 2 joint 3 swings with up
    to 100°/s, and time-delay estimation has to correct the effects of that motion. The weight changes that
    motion, too: with $Q_2 = 0.01$ the hand is off by 1.8 mm.
    """,
    prediction=Choice(
        "With strict priorities, which of the two tasks has an error in the conflict?",
        (
            Option("the hand, a little", low=3.0),
            Option("only joint 1", high=3.0),
        ),
        Measure(HAND),
        tempting=0,
    ),
    claims=(
        Claim(
            "The hand stays within 1.5 mm of its circle.",
            Measure(HAND),
            "at most",
            1.5,
            fails_with=("controller=weighted",),
            because="equal weights allow a large error of the hand",
        ),
        Claim(
            "Joint 1 has the error: it is off by more than 30°.",
            Measure(Q1),
            "at least",
            30.0,
            fails_with=("controller=weighted",),
            because="in a weighted sum the hand has most of the error",
        ),
    ),
    duration=SECONDS,
    ghost=Ghost("weighted, Q₁ = Q₂", ("controller=weighted",)),
    controls=(CONTROLLER, WEIGHT),
    plots=PLOTS,
)

LIMIT = Step(
    title="Is a large weight a priority?",
    text=r"""
    The tasks are weighted again, but now the hand counts 200 times as much: $Q_1 = 200$, $Q_2 = 1$. The
    ghost has strict priorities.
    """,
    do=r"""
    Make Q of level 2 ten and a hundred times smaller still. Then let joint 1 swing by 20° only, where both
    tasks can be fulfilled, and reduce Q to its smallest value.
    """,
    why=r"""
    The error of the hand is smaller, but still several times that of a strict priority. In the limit of a
    very small $Q_2$ the weighted solution becomes the strict one. But such a small $Q$ no longer outweighs
    $R$. With the smaller swing joint 1 is off by 0.02° with $Q_2 = 1$, and by 0.05° with 0.01. At the end
    of the slider, with $10^{-5}$, it is off by 13° of its 20°: there joint 1 no longer follows its
    reference, although this would be possible. With a smaller $R$ it would follow.
    """,
    prediction=Choice(
        "The hand counts 200 times as much as joint 1. The largest error of the hand is …",
        (
            Option("the same as with strict priorities", high=1.5),
            Option("several times larger", 1.5, 30.0),
            Option("still centimetres", low=30.0),
        ),
        Measure(HAND, over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "The largest error of the hand is more than twice its error with strict priorities.",
            Measure(HAND, over_ghost=True),
            "at least",
            2.0,
            fails_with=("controller=himpc",),
            because="then both robots have the same settings",
        ),
    ),
    set=("controller=weighted", "levels.q1.Q=1"),
    duration=SECONDS,
    ghost=Ghost("himpc: strict priorities", ("controller=himpc",)),
    controls=(CONTROLLER, WEIGHT, SWING),
    plots=PLOTS,
)

CHALLENGE = Challenge(
    text=r"""
    At the start the tasks have equal weights. Keep the hand within 5 mm of its circle while joint 1 still
    gets as close to its reference as it can (within 80°), with torque changes below 0.1 N·m RMS.
    """,
    goals=(
        Claim("The hand stays within 5 mm.", Measure(HAND), "at most", 5.0),
        Claim("Joint 1 stays within 80°.", Measure(Q1), "at most", 80.0),
        Claim(
            "Torque changes stay below 0.1 N·m RMS.",
            Measure(Signal("delta_tau", "N·m"), "rms"),
            "at most",
            0.1,
        ),
    ),
    knobs=(CONTROLLER, WEIGHT, Control("levels.position.Q", "Q of level 1", 1.0, 1e5, log=True)),
    score=Score(Measure(HAND, "rms"), worst=5.0, best=0.2),
    solutions=(("controller=himpc",), ("levels.q1.Q=0.3",)),
    set=("controller=weighted",),
    duration=SECONDS,
)

LESSON = Lesson(
    name="two-tasks",
    card=card_of(__doc__),
    scene="planar3-conflict",
    steps=(BOTH, WEIGHTED, STRICT, LIMIT),
    challenge=CHALLENGE,
)

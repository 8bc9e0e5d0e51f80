"""Your robot

A robot file from the internet lacks half of its numbers: how long does it take until the robot moves well?

Minutes: 15
You need: lesson "no-model-needed"; a URDF of your own, if you have one
"""

from __future__ import annotations

from pathlib import Path

from lessons.events import MoveTarget
from lessons.teaching.challenge import Challenge, Score
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

HAND = Signal("error/position", "mm")
TILT = Signal("error/orientation", "deg")
PLOTS = (HAND, TILT, Signal("gauge_radius"))
LAMP = str(Path(__file__).with_name("lamp.urdf"))
MOVE = ((0.1, MoveTarget("position", (0.359, 0.1, 0.153))),)
M_BAR = Control("M_bar_scale", "M̄, factor", 0.1, 4.0, log=True)
K_P = Control("tasks.position.K_p", "K_P of the position, 1/s²", 10.0, 400.0, log=True)
K_V = Control("tasks.position.K_v", "K_V of the position, 1/s", 2.0, 60.0)
HEAVY = ("plant.mass_scale=1.5", "plant.inertia_scale=1.5")

LOAD = Step(
    title="Load it",
    text=r"""
    The file `lamp.urdf` describes a desk lamp, and is as incomplete as many robot files. `himpc-lab robots
    --check lamp.urdf` lists what is missing: a joint without end stops, a head without inertia, a joint
    without a speed limit. The program reports the values that it fills in, and refuses a file whose values
    it cannot fill in. The stack is made for any robot: position, then orientation, then posture. The
    program suggests $\bar M$ from the masses in the file, with a margin, and the gains from the speed of
    the loop with this $\bar M$.
    """,
    do="Load a URDF of your own: Robot, Load URDF, or himpc-lab --urdf FILE.",
    why=r"""
    The lamp has five joints for six coordinates of the head: no free motion is left, and one more joint
    would be needed. The hierarchy resolves this conflict by itself: the position is reached, the
    orientation as far as five joints allow, and no motion is left for the posture. In a weighted sum the
    position has an error instead.
    """,
    prediction=Choice(
        "The lamp has five joints, and its head is moved by 11 cm. In the end …",
        (
            Option("the head is on its target, as upright as before", high=1.0),
            Option("the head is on its target, but tilted", low=5.0),
        ),
        Measure(TILT, "last"),
        tempting=0,
    ),
    claims=(
        Claim(
            "In the end the head is within 0.2 mm of the target.",
            Measure(HAND, "last"),
            "at most",
            0.2,
            fails_with=("controller=weighted",),
            because="in a sum the orientation and the posture hold the head back, even one of the two alone",
        ),
        Claim(
            "The head is tilted by more than 5°.",
            Measure(TILT, "last"),
            "at least",
            5.0,
            fails_with=("controller=weighted",),
            because="then the position has the error instead",
        ),
    ),
    events=MOVE,
    duration=1.5,
    controls=(Control("levels.orientation.enabled", "Orientation on", choices=(False, True)),),
    plots=PLOTS,
)

WRONG = Step(
    title="The file is wrong",
    text=r"""
    Masses in such files are often inaccurate. Suppose that every link of the real lamp is 50 % heavier than
    in its file. The ghost is the model-based HQP with the masses of the file.
    """,
    do="Try 0.7 times and twice the mass, with both controllers.",
    why=r"""
    In HIMPC only the suggestion for $\bar M$ depends on those masses, and this suggestion has a margin. The
    ghost uses the masses of the file: its springs must carry the additional weight, and the head stays too
    low.
    """,
    prediction=Choice(
        "The lamp is 50 % heavier than in its file. Where is the head in the end?",
        (
            Option("on the target, within 1 mm", high=1.0),
            Option("some millimetres low", 1.0, 10.0),
            Option("centimetres low", low=10.0),
        ),
        Measure(HAND, "last"),
        tempting=2,
    ),
    claims=(
        Claim(
            "In the end the head is within 1 mm of its target.",
            Measure(HAND, "last"),
            "at most",
            1.0,
            fails_with=("controller=hqp",),
            because="HQP compensates the weight in the file instead of the lamp's true weight",
        ),
    ),
    set=HEAVY,
    events=MOVE,
    duration=1.5,
    ghost=Ghost("hqp with the masses of the file", ("controller=hqp",)),
    controls=(
        Control("plant.mass_scale", "True mass, factor", 0.5, 2.0),
        Control("controller", "Controller", choices=("himpc", "hqp")),
    ),
    plots=PLOTS,
)

TUNE = Step(
    title="Make it yours",
    text=r"""
    The suggested $\bar M$ must be safe in all poses of the lamp. Your own $\bar M$ need only be safe in the
    poses that you use. Here it is twice the suggestion; the ghost keeps the suggestion. Then use the
    controller in your own program: *export* writes a Python script of twenty lines that runs this stack:
    `load_robot("lamp.urdf")`, `Level((FramePosition(…),))`, `HIMPC(robot, Settings(stack, M_bar))`, and
    `step` once a millisecond.
    """,
    do="Set 3 times the suggestion and read the gauge. Then export, and run the script.",
    why=r"""
    The error is less than half of the ghost's. At three times the suggestion the gauge passes 1 and the
    lamp becomes unstable: this factor is your margin. `himpc-lab tune` does the same search step by step.
    """,
    claims=(
        Claim(
            "The largest error is at most 0.6 times that with the suggested M̄.",
            Measure(HAND, over_ghost=True),
            "at most",
            0.6,
            fails_with=("M_bar_scale=1",),
            because="then both robots have the same settings",
        ),
        Claim(
            "The gauge stays below 1.",
            Measure(Signal("gauge_radius")),
            "at most",
            1.0,
            fails_with=("M_bar_scale=4",),
            because="with this M̄ errors grow from step to step",
        ),
    ),
    set=("M_bar_scale=2",),
    events=MOVE,
    duration=1.0,
    ghost=Ghost("M̄ as suggested", ("M_bar_scale=1",)),
    controls=(M_BAR, K_P, K_V),
    plots=PLOTS,
)

CHALLENGE = Challenge(
    text=(
        "The links of the lamp are heavier than in its file again, and the motion is the same. Keep the head "
        "within 7 mm of its target all the time."
    ),
    goals=(
        Claim("The head stays within 7 mm.", Measure(HAND), "at most", 7.0),
        Claim("The gauge stays below 1.", Measure(Signal("gauge_radius")), "at most", 1.0),
    ),
    knobs=(M_BAR, K_P, K_V),
    score=Score(Measure(HAND), worst=7.0, best=2.0),
    solutions=(
        ("M_bar_scale=2",),
        ("M_bar_scale=1.3", "tasks.position.K_p=300", "tasks.position.K_v=35"),
    ),
    set=HEAVY,
    events=MOVE,
    duration=1.0,
)

LESSON = Lesson(
    name="your-robot",
    card=card_of(__doc__),
    scene="hold",
    urdf=LAMP,
    set=("avoidance.on=false", "limits.stall_guard=false"),
    steps=(LOAD, WRONG, TUNE),
    challenge=CHALLENGE,
)

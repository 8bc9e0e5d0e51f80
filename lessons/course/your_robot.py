"""Your robot

A file from the internet, no manual, half the numbers missing: how long until it moves well?

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
    This is a desk lamp, `lamp.urdf`, a file with the usual gaps. `himpc-lab robots
    --check lamp.urdf` says what is missing: a joint without end stops, a head without inertia, a
    joint without a speed limit. What is filled in is reported, what cannot be is refused. The stack
    is made for any robot: position, then orientation, then posture. $\bar M$ is suggested from the
    masses in the file, on the safe side, and the gains from how fast that $\bar M$ lets the loop
    follow.
    """,
    do="Load a URDF of your own: Robot, Load URDF, or himpc-lab --urdf FILE.",
    why=r"""
    Five joints for six coordinates of the head: no freedom is left, one coordinate is even missing.
    The hierarchy decides by itself: the position is reached, the orientation as far as five joints can,
    and the posture is given up. A weighted sum gives up the position instead.
    """,
    prediction=Choice(
        "The head is moved by 11 cm. It has five joints. In the end …",
        (
            Option("it is there, as upright as before", high=1.0),
            Option("it is there, but tilted", low=5.0),
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
            because="in a sum the orientation and the posture hold the head back, each of them alone as well",
        ),
        Claim(
            "It is tilted by more than 5°.",
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
    Masses in such files are guesses. Suppose the real lamp is 50 % heavier than its file says, in
    every link. The ghost is the model-based HQP with the masses of the file.
    """,
    do="Try 0.7 times and twice the mass, with both controllers.",
    why=r"""
    Nothing in HIMPC depended on those masses but the suggestion for $\bar M$, and that had room.
    The ghost believes the file: its springs must carry the weight that the file does not contain, and
    the head stays too low.
    """,
    prediction=Choice(
        "The lamp is half as heavy again as its file says. Where is the head in the end?",
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
            "In the end the head is within 1 mm.",
            Measure(HAND, "last"),
            "at most",
            1.0,
            fails_with=("controller=hqp",),
            because="it compensates the weight in the file instead of the lamp's true weight",
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
    The suggested $\bar M$ must be safe wherever the lamp may go. Yours need only be safe where it
    works. Twice as much here; the ghost keeps the suggestion. Then take it home: *export* writes a
    Python script of twenty lines that runs this very stack, `load_robot("lamp.urdf")`,
    `Level((FramePosition(…),))`, `HIMPC(robot, Settings(stack, M_bar))`, `step` once a millisecond.
    """,
    do="Go on to 3 and read the gauge. Then export, and run the script.",
    why=r"""
    Less than half the error. At three times the suggestion the gauge passes 1 and the lamp is lost:
    you have found your margin. `himpc-lab tune` does the same search step by step.
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
    text="The heavy lamp again, and the same move. Keep the head within 7 mm of its target all along.",
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
    steps=(LOAD, WRONG, TUNE),
    challenge=CHALLENGE,
)

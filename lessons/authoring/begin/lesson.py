"""A lesson of my own

Does a heavier hand sag?

Minutes: 5
You need: nothing
"""

# The text above is the lesson's card: title, question, duration in minutes, required knowledge.
#
#     himpc-lab --lesson FILE.py             opens the lesson
#     himpc-lab lessons --check FILE.py tests that every claim holds, and fails with its `fails_with`

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

HAND = Signal("error/position", "mm")  # a field of a run's rows: himpc-lab run --npz FILE lists them

LOAD = Step(
    title="An unknown load",
    # Markdown, with equations in $…$.
    text=r"""
    The hand carries 2 kg from the start, and the controller does not know it. The controller estimates all
    forces from the torque and the acceleration one millisecond ago: $\hat H = \tau_0 - \bar M \ddot q_0$.
    """,
    do="Change the load while the robot holds, and watch the hand.",
    why="The estimate contains the load: the hand stays within a tenth of a millimetre.",
    prediction=Choice(
        "How far does the hand move, at most?",
        (Option("less than 1 mm", high=1.0), Option("a few centimetres", low=1.0)),
        Measure(HAND),
        tempting=1,
    ),
    claims=(
        Claim(
            "The hand stays within 0.1 mm.",
            Measure(HAND),
            "at most",
            0.1,
            # A claim names a setting under which it is false; the check runs this setting, too.
            fails_with=("controller=osf",),
            because="OSF computes its torque with a model that does not contain the load",
        ),
    ),
    set=("plant.payload_kg=2",),
    duration=1.0,
    controls=(Control("plant.payload_kg", "Load, kg", 0.0, 5.0),),
    plots=(HAND,),
)

LESSON = Lesson(name="a-lesson-of-my-own", card=card_of(__doc__), scene="iiwa14-hold", steps=(LOAD,))

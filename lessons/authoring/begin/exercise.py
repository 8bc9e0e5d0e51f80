"""An exercise of my own

How does a joint come back to its place without swinging?

Minutes: 15
You need: what a torque is
"""

# The text above is the exercise's card: title, question, duration in minutes, required knowledge.
#
#     himpc-lab grade --check FILE.py              shows the card; tests the solution and every mistake
#     himpc-lab new controller start.py --from FILE.py   writes the file with which students begin
#     himpc-lab grade submissions/ FILE.py               grades a folder, or one file

from lessons.exercises.exercise import GradeCheck, pushed
from lessons.exercises.own import own_exercise
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

# The code with which students begin. Their lines replace the line with TODO; `now` has the symbols of the
# paper.
START = """
def torque(now):
    posture = now.level("posture")
    # TODO: a spring K_p and a damper K_v on posture.error and posture.x_dot, times M̄
    return now.gravity
"""

SOLUTION = """
acceleration = -posture.K_p * posture.error - posture.K_v * posture.x_dot
return now.gravity + now.M_bar * acceleration
"""

# Wrong lines, each after a sentence that names the mistake. A student whose file gives the same torques as
# the wrong lines reads this sentence.
MISTAKES = {
    "the damping K_v is missing": """
        return now.gravity - now.M_bar * posture.K_p * posture.error
        """,
    "the stiffness K_p is missing": """
        return now.gravity - now.M_bar * posture.K_v * posture.x_dot
        """,
    "the stiffness K_p has the wrong sign": """
        acceleration = posture.K_p * posture.error - posture.K_v * posture.x_dot
        return now.gravity + now.M_bar * acceleration
        """,
}

# The scene, with the settings of himpc-lab run planar3-hold --set …; only the posture is controlled.
ARM = RunSpec(
    "planar3-hold",
    set=(
        "levels.position.enabled=false",
        "levels.orientation.enabled=false",
        "levels.posture.K_p=2000",
        "levels.posture.K_v=400",
    ),
    duration=1.0,
)


def checks(seed):
    """Returns the statements to be measured; the seed decides the direction of the push."""
    push = pushed(ARM, seed, "link_3", 10.0, plane=True)
    return (
        GradeCheck(
            "The arm comes back after a push.",
            "the spring K_p does not pull it back",
            push,
            0.5,
            measure=Measure(Signal("error/posture", "deg"), "last"),
            points=6,
        ),
        GradeCheck(
            "The arm is at rest afterwards.",
            "the damper K_v does not brake it",
            push,
            5.0,
            measure=Measure(Signal("v", "deg/s"), "last"),
            points=4,
        ),
    )


EXERCISE = own_exercise(
    name="my-exercise",
    card=card_of(__doc__),
    plain="τ = g(q) + M̄ (−K_v q̇ − K_p (q − q_d))",
    start=START,
    solution=SOLUTION,
    mistakes=MISTAKES,
    hints=("A spring pulls back: minus K_p times the error.", "A damper brakes: minus K_v times q̇."),
    checks=checks,
)

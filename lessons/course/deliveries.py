"""Deliveries

Three people wait for a ball each: must the robot finish one task before it begins the next?

Minutes: 15
You need: lesson "first-hold-then-reach"
"""

from __future__ import annotations

from lessons.events import MoveTarget, Release
from lessons.teaching.challenge import Challenge, Score
from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

HAND = Signal("error/ee", "mm")
WAY = Signal("way of the base", "m")
WORK = Signal("time at work", "s")
PLACE = Signal("place")
ARCHITECTURE = Control("architecture", "Tasks at a time", choices=("hierarchical", "single_task"))
CRUISE = Control("cruise", "Speed of the planned paths, m/s", 0.2, 1.0)
SINGLE = ("architecture=single_task",)
ONE_BY_ONE = Ghost("one task at a time", SINGLE)
ROUND = ("seats=[0,2,5]", "rounds=1", "hold_s=1")
PASSES = ("base_tolerance=0.8", "base_at_rest=false")
TAKEN = ((14.0, Release("ee 1")), (15.0, Release("ee 2")))
PLOTS = (PLACE, HAND, WAY)

OVERLAP = Step(
    title="Two tasks at the same time",
    text=r"""
    A round to three people is a list of tasks that alternate: base to a place near the person, hand to the
    person's hand for one second, base to the next place, … The controller receives a window of $L$ tasks of
    this list, $[\mathcal T_{l_0}, \ldots, \mathcal T_{l_0+L-1}]$. When $\mathcal T_{l_0}$ is done the
    window moves to the next task. The ghost has $L = 1$: it drives, reaches, waits, drives. Here $L = 2$:
    the current task ranks first, the next task second. For both robots a task of the hand is done when the
    hand has been within 2 cm of its goal for a second. A task of the base is done as soon as the base is
    within 80 cm of its place.
    """,
    do="With faster paths, is the ghost as fast as the robot? What does the ghost's base do at each stop?",
    why=r"""
    The robot needs less than two thirds of the ghost's time and distance. While the hand holds the ball
    out, the base leaves for the next person, as far as the arm allows. While the base drives, the hand
    reaches. By itself, leaving early saves 9 of the ghost's 31 seconds, and reaching early saves 7 (with
    the second task active in one phase only). Both together save 11, less than the sum: once the base is
    there, no driving is left during which the hand could reach. The distance is shorter because the robot's
    base stays behind its hand. The ghost's only task is the hand, and its base moves with the hand.
    """,
    prediction=Choice(
        "With the same places and the same speed of the paths, two tasks at a time take …",
        (
            Option("nearly as long: the distance is the same", low=0.85),
            Option("about two thirds of the time", 0.55, 0.85),
            Option("less than half the time", high=0.5),
        ),
        Measure(WORK, over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "The round takes at most 0.7 times as long.",
            Measure(WORK, over_ghost=True),
            "at most",
            0.7,
            fails_with=SINGLE,
            because="then both robots have the same settings",
        ),
        Claim(
            "After 22 s all six tasks are done.",
            Measure(PLACE, until=22.0),
            "at least",
            6.0,
            fails_with=SINGLE,
            because="the robot is still on its way to the third person",
        ),
        Claim(
            "The base drives at most 0.7 times as far.",
            Measure(WAY, over_ghost=True),
            "at most",
            0.7,
            fails_with=SINGLE,
            because="the base moves with the hand",
        ),
    ),
    set=ROUND,
    duration=45.0,
    ghost=ONE_BY_ONE,
    controls=(ARCHITECTURE, CRUISE),
    plots=PLOTS,
)

THERE = Step(
    title="When is the base there?",
    text=r"""
    A rule must define when *base to a place near the person* is done. So far the task was done within 80 cm
    of the place, at any speed. Now the base must come within 5 cm and stop there, and again the rule is the
    same for both robots. Which of the two robots loses more time by this rule?
    """,
    do="Set the distance to 5, 25 and 50 cm, without the condition of rest. How does the factor change?",
    why=r"""
    The strict rule costs the ghost 11 seconds and the other robot 14. Under the first rule the robot with
    two tasks could pass the place at a distance of 80 cm. It loses more because it now has to go all the
    way to the place: its base drives farther by half. The ghost's base drives only a tenth farther, because
    it went up to the people under the first rule as well. Each of the rule's two conditions makes the base
    go all the way. The condition of 5 cm alone, at any speed, costs the ghost 8 s and the other robot 12.
    The condition of rest alone, within 80 cm, costs as much as the whole rule: the base comes to rest only
    at its place. So the factor between the two ways of working depends on the rule: it was 1.6 before and
    is 1.2 now. Two tasks at a time under the first rule take 22 s less than the 41 s of one task at a time
    under the strict rule. About half of this saving is due to the rule: 11 s if the rule is changed first,
    and 14 s if the rule is changed last. The paper measured a factor of 2.3 over four rounds, against a
    robot whose base and arm move in turn. The paper does not say when a task of the base is done.
    """,
    prediction=Choice(
        "Both robots have to stop at every place. Two tasks at a time now take …",
        (
            Option("less than half the ghost's time: the ghost stopped before as well", high=0.5),
            Option("two thirds of the ghost's time, as in the step before", 0.55, 0.7),
            Option("more than three quarters of the ghost's time", low=0.75),
        ),
        Measure(WORK, over_ghost=True),
        tempting=1,
    ),
    claims=(
        Claim(
            "Two tasks at a time are still faster: at most 0.9 times the ghost's time.",
            Measure(WORK, over_ghost=True),
            "at most",
            0.9,
            fails_with=SINGLE,
            because="then both robots have the same settings",
        ),
        Claim(
            "Two tasks save less than in the step before: more than 0.75 of the ghost's time remains.",
            Measure(WORK, over_ghost=True),
            "at least",
            0.75,
            fails_with=PASSES,
            because="then only the ghost has to stop, and the two robots keep different rules",
        ),
    ),
    set=(*ROUND, "base_tolerance=0.05", "base_at_rest=true"),
    duration=45.0,
    ghost=ONE_BY_ONE,
    controls=(
        ARCHITECTURE,
        Control("base_tolerance", "Base has arrived within, m", 0.05, 0.8),
        Control("base_at_rest", "and at rest", choices=(False, True)),
    ),
    plots=PLOTS,
)

WAIT = Step(
    title="A person who takes the ball late",
    text=r"""
    The time that a person needs to take a ball is unknown. The hand is with the first person by 3 s. Here
    the ball is taken at 14 s, and the controller receives this information only then. Until 14 s $\mathcal
    T_{l_0}$ is *hand at the person's hand*, of unknown duration, and the next place of the base, 2 m
    farther, is out of reach. What will the base do during this time?
    """,
    do="Release the ball yourself, early or late. Can you predict how long the rest of the round will take?",
    why=r"""
    The base goes as far as the arm allows and waits there, with the arm stretched. When the ball is taken
    the window moves to the next task, and the rest of the way is short: the robot needs three seconds to
    the second person. The ghost, whose only task was the hand, needs nearly seven. The duration of the
    wait is not part of the problem, and the plan does not need it.
    """,
    prediction=Choice(
        "From 5 s until the ball is taken, how far does the base drive?",
        (
            Option("not at all: the hand must stay", high=0.05),
            Option("some decimetres, to the limit of the arm's reach", 0.2, 1.4),
            Option("all of the 2 m to its next place", low=1.4),
        ),
        Measure(WAY, "range", after=5.0, until=14.0),
        tempting=0,
    ),
    claims=(
        Claim(
            "While the hand waits, from 5 s to 14 s, the base drives at least 45 cm.",
            Measure(WAY, "range", after=5.0, until=14.0),
            "at least",
            0.45,
            fails_with=SINGLE,
            because="with the hand as the only task, the robot rests when the hand has arrived",
        ),
        Claim(
            "The ball does not move: the hand stays within 1 mm.",
            Measure(HAND, after=5.0, until=14.0),
            "at most",
            1.0,
            fails_with=("formulation=paper",),
            because="if the first level also minimises effort, the hand slips",
        ),
        Claim(
            "Both balls are delivered within 18 s.",
            Measure(PLACE, until=18.0),
            "at least",
            4.0,
            fails_with=SINGLE,
            because="then the base starts only when the ball is taken",
        ),
    ),
    events=TAKEN,
    duration=26.0,
    ghost=ONE_BY_ONE,
    controls=(ARCHITECTURE,),
    plots=PLOTS,
)

MOVES = Step(
    title="People move",
    text=r"""
    The wait is the same, and at 8 s the second person walks to another seat: the goals of tasks three and
    four change while the hand is still with the first person. At 16.5 s, when the hand has almost arrived,
    the second person lifts the place for the ball by 20 cm and shifts it by 30 cm. No plan starts again
    from the beginning: the references $r$ in (8) change, and the next plan, a tenth of a second later, uses
    the new ones. The ghost is HTIDKC, which has no plan.
    """,
    do="Move the people yourself, while the ball waits and while the robot is on its way.",
    why=r"""
    At 8 s the base drives along the limit of the arm's reach, 5 cm before the point nearest to the old
    place. Then it drives back along this limit to the point nearest to the new place. At 16.5 s the hand
    turns to the new goal, and a second later the hand is within two centimetres of this goal. The goals
    changed twice, and the controller received only new references. The goals are positions in the room in
    which the people move.
    """,
    prediction=Choice(
        "At 16.5 s the goal jumps by 36 cm, when the hand has almost arrived. One second later the hand is …",
        (
            Option("still more than 10 cm off", low=100.0),
            Option("some centimetres off", 20.0, 100.0),
            Option("there within 2 cm", high=20.0),
        ),
        Measure(HAND, after=17.5, until=19.5),
        tempting=1,
    ),
    claims=(
        Claim(
            "From 18.5 s on the hand is within 5 mm of the new goal.",
            Measure(HAND, after=18.5, until=19.5),
            "at most",
            5.0,
            fails_with=("controller=htidkc",),
            because="with the authors' gain the hand needs seconds for the last part of the way",
        ),
        Claim(
            "Between 8 s and 14 s the base moves towards the new place by at least 10 cm.",
            Measure(WAY, "range", after=8.0, until=14.0),
            "at least",
            0.1,
            fails_with=SINGLE,
            because="with one task at a time the controller does not yet know the next place",
        ),
        Claim(
            "Meanwhile the first ball stays within 1 mm.",
            Measure(HAND, after=5.0, until=14.0),
            "at most",
            1.0,
            fails_with=("formulation=paper",),
            because="if the first level also minimises effort, the hand slips",
        ),
    ),
    events=(
        (8.0, MoveTarget("base 2", (-1.2, -0.4))),
        (8.0, MoveTarget("ee 2", (-1.9, -0.7, 0.8))),
        (14.0, Release("ee 1")),
        (16.5, MoveTarget("ee 2", (-1.9, -0.4, 1.0))),
        (19.5, Release("ee 2")),
    ),
    duration=20.0,
    ghost=Ghost("HTIDKC", ("controller=htidkc",)),
    controls=(ARCHITECTURE, Control("controller", "Controller", choices=("htmpc", "htidkc"))),
    plots=PLOTS,
)

CHALLENGE = Challenge(
    text=r"""
    One round to three people, one task at a time, takes 31 s and 9.8 m of driving. Finish the round within
    25 s, with less than 8 m of driving. The score is the time of the round.
    """,
    goals=(
        Claim("All six tasks are done within 25 s.", Measure(PLACE, until=25.0), "at least", 6.0),
        Claim("The base drives less than 8 m.", Measure(WAY), "at most", 8.0),
    ),
    knobs=(ARCHITECTURE, CRUISE),
    score=Score(Measure(WORK), worst=25.0, best=12.0),
    solutions=(("architecture=hierarchical",), ("architecture=hierarchical", "cruise=1")),
    set=(*ROUND, *SINGLE),
    duration=45.0,
)

LESSON = Lesson(
    name="deliveries",
    card=card_of(__doc__),
    scene="ridgeback-ur10-handover",
    steps=(OVERLAP, THERE, WAIT, MOVES),
    challenge=CHALLENGE,
)

"""Told wrong

A robot receives a wrong report of the position of a crate: what is the effect of this error?

Minutes: 10
You need: lesson "first-hold-then-reach"
"""

from __future__ import annotations

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option

HAND = Signal("error/ee", "mm")
BASE = Signal("error/base", "m")
DISTANCE = Signal("clearance", "mm")
REPORTED = Signal("clearance_reported", "mm")
NEVER_WRONG = ("false_report=false",)
IN_TIME = ("report_end=5",)
ON_THE_WAY = ("obstacles.crate=[1.9,0.3,0.25]", "report_offset=[0,1.1,0]")
WRONG = Control("false_report", "The report is wrong for a while", choices=(False, True))
UNTIL = Control("report_end", "Right again from, s", 2.0, 12.0)

NOT_THERE = Step(
    title="A reported crate at a wrong position",
    text=r"""
    Level 1 moves the hand along a line for 4 m. Level 2 moves the base along a line of its own. A crate
    stands 1.4 m beside the line of the base. Every plan bounds the signed distance of each body $B$ of the
    robot to each obstacle $O$ at every knot,

    $$\mathrm{sd}(B(q_k), O) \ge d_{\mathrm{safe}} \quad (7c),$$

    with $d_{\mathrm{safe}}$ = 5 cm. A camera and a map report the place of $O$. From 1 s to 7 s they report
    the crate 1.1 m away from its true place, next to the line of the base: the outline shows the reported
    place. The hand can pass above the low crate, and the base has to make way. Then the report is
    corrected.
    """,
    do="Correct the report at 5 s. Then put the base first, in the tab Mission.",
    why=r"""
    The base makes way: it leaves its line by 57 cm, and the hand stays within half a millimetre of its own
    line. The distance bounds every level, and the order decides which task has an error: with the base
    first the hand swings out by 48 cm. The controller does not store old reports. After the correction the
    next plan uses the true place of the crate, and from 9 s on the base is within 2 cm of its line. The
    only task of the ghost is the hand. The ghost makes way as well, but its base comes back only as far as
    its hand needs: at 12 s its base is still 71 cm away from its line.
    """,
    prediction=Choice(
        "The base cannot pass the reported place of the crate. The hand leaves its line by …",
        (
            Option("more than 10 cm: the base carries the hand", low=100.0),
            Option("some millimetres or centimetres", 1.0, 100.0),
            Option("less than 1 mm", high=1.0),
        ),
        Measure(HAND),
        tempting=0,
    ),
    claims=(
        Claim(
            "The hand stays within 1 mm of its reference.",
            Measure(HAND),
            "at most",
            1.0,
            fails_with=("order=base,ee",),
            because="then the hand makes way for the base",
        ),
        Claim(
            "The base leaves its reference by at least 50 cm.",
            Measure(BASE),
            "at least",
            0.5,
            fails_with=NEVER_WRONG,
            because="then nothing is in its way",
        ),
        Claim(
            "From 9.5 s on the base is within 1 cm of its reference.",
            Measure(BASE, after=9.5),
            "at most",
            0.01,
            fails_with=("controller=stmpc",),
            because="then the base has no task",
        ),
        Claim(
            "The distance of the crate is never less than 40 cm.",
            Measure(DISTANCE, "smallest"),
            "at least",
            400.0,
            fails_with=("obstacles.crate=[1.9,0.8,0.25]",),
            because="then the crate itself stands near the line",
        ),
    ),
    duration=12.0,
    ghost=Ghost("the hand alone", ("controller=stmpc",)),
    controls=(
        Control("controller", "Controller", choices=("htmpc", "stmpc", "htidkc")),
        WRONG,
        UNTIL,
    ),
    plots=(BASE, HAND, DISTANCE, REPORTED),
)

THERE = Step(
    title="A crate that is really there",
    text=r"""
    Now the true and the reported place are exchanged: the crate stands next to the line of the base, and
    until 7 s it is reported 1.1 m away from there. Everything else is the same. At velocity level the
    simulation has no contacts: the crate does not stop the robot, and the distance becomes negative where
    the two overlap.
    """,
    do="How late can the report be corrected? Find the latest time with which the robot keeps its 5 cm.",
    why=r"""
    The robot drives 40 cm into the crate; until 7 s its base is never more than 3 mm from its line. The
    bound keeps a distance from the reported crate, not from the true one. The time of the correction is
    decisive. A correction at 5 s is early enough: 5 cm are kept and the hand stays on its line. A
    correction at 5.4 s is nearly too late: 2 cm are left. The hand swings out by 12 cm meanwhile, because
    the base's acceleration may change by at most 10 m/s³: without this bound it swings out by 3 cm. A
    correction at 5.6 s is too late: the robot overlaps the crate by 7 cm. A larger margin helps against
    small errors of a report. The authors of HTMPC keep a map instead, and infer with Bayes' rule from the
    observations which objects still stand at their places in the map (given, not measured here).
    """,
    prediction=Choice(
        "The crate is reported beside the line until 7 s. The least distance to the crate is …",
        (
            Option("5 cm, as always", low=40.0),
            Option("less, but the robot stops before the crate", 0.0, 40.0),
            Option("none: the robot drives into the crate", high=0.0),
        ),
        Measure(DISTANCE, "smallest"),
        tempting=0,
    ),
    claims=(
        Claim(
            "The robot overlaps the crate by at least 30 cm.",
            Measure(DISTANCE, "smallest"),
            "at most",
            -300.0,
            fails_with=IN_TIME,
            because="then the controller receives the right report in time",
        ),
        Claim(
            "Until 7 s the base stays within 5 mm of its reference.",
            Measure(BASE, until=7.0),
            "at most",
            0.005,
            fails_with=NEVER_WRONG,
            because="then the base makes way",
        ),
        Claim(
            "From 8.5 s on the robot is at least 4 cm away from the crate.",
            Measure(DISTANCE, "smallest", after=8.5),
            "at least",
            40.0,
            fails_with=("report_end=12",),
            because="then the report is still wrong",
        ),
    ),
    set=ON_THE_WAY,
    duration=12.0,
    controls=(WRONG, UNTIL),
    plots=(DISTANCE, REPORTED, BASE, HAND),
)

LESSON = Lesson(
    name="told-wrong",
    card=card_of(__doc__),
    scene="ridgeback-ur10-perception",
    steps=(NOT_THERE, THERE),
)

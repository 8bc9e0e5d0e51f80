"""Interventions for the causes in the lessons on a mobile robot and on a user's own robot, in the order of
the course."""

from __future__ import annotations

from interventions import Intervention, of

HAND = of("error/position", "mm")
EE = of("error/ee", "mm")
NO_LIMITS = ("limits.velocity=false", "limits.acceleration=false", "limits.jerk=false")
TILT = of("error/orientation", "deg", "last")
BASE_10 = of("error/base", "m", "mean", 10.0, 10.2)
DEEP = of("clearance", "m", "smallest")
KEPT = (0.045, 0.055)

# fmt: off
MOBILE_ROWS = (
    # ---------------------------------------- first-hold-then-reach
    Intervention(
        "first-hold-then-reach/0", "priorities decide which task may have an error on the way",
        EE, (0, 0.1), ("order=base,ee",), (100, 140),
    ),
    Intervention(
        "first-hold-then-reach/2", "the hand is left behind by exactly these 1.63 m",
        of("error/ee", "m", "mean", 8.5), (1.625, 1.635), ("levels.base.enabled=false",), (0, 0.01),
    ),
    Intervention(
        "first-hold-then-reach/1",
        "Here every plan that makes $\\mathcal J_2$ smaller also changes $\\mathcal J_1$.",
        of("error/base", "m", "mean", 7.0), (1.55, 1.7), ("order=base,ee",), (0, 0.05),
    ),
    # ---------------------------------------- how-strict-is-strict
    Intervention(
        "how-strict-is-strict/0", "and the line search accepts no step",
        of("way of the base", "m"), (0, 0.01), ("delta_m=0.001",), (1.0, 3.0),
    ),

    Intervention(
        "how-strict-is-strict/3", "in the best plan of level 1 the hand slips a little",
        EE, (12, 20), ("velocity_effort=0.001",), (2, 9),
    ),
    Intervention(
        "how-strict-is-strict/3", "$\\delta$ is added to the slip", EE, (12, 20), ("delta_m=0.001",), (2, 9),
    ),
    # ---------------------------------------- seeing-ahead
    Intervention(
        "seeing-ahead/0", "without preview the controller receives the next place only at 8 s",
        of("way of the base", "m", "range", 6.5, 8.0), (0, 0.05), ("controller=htmpc",), (0.4, 0.8),
        of=("controller=htmpc_wpt",), seconds=8.0,
    ),
    Intervention(
        "seeing-ahead/1",
        "Without the bound on this change, the hand is off by 6 mm with the same horizon of 0.2 s",
        EE, (25, 40), ("limits.jerk=false",), (5.5, 6.9),
    ),
    Intervention(
        "seeing-ahead/1", "half the top speed, it is off by 4 mm",
        EE, (25, 40), ("limits.velocity_scale=0.5",), (3.5, 4.5),
    ),
    Intervention(
        "seeing-ahead/1", "three times as high hardly helps",
        EE, (20, 40), ("limits.acceleration_scale=3",), (20, 40), stays=True,
    ),
    Intervention(
        "seeing-ahead/2", "without any limit on speed and acceleration HTIDKC is hardly nearer home",
        of("error/base", "m", "mean", 15.9), (0.14, 0.17), NO_LIMITS, (0.14, 0.17), stays=True,
    ),
    Intervention(
        "seeing-ahead/2", "with a gain of 2 1/s it arrives",
        of("error/base", "m", "mean", 15.9), (0.14, 0.17), ("gains=[2,2]",), (0, 0.01),
    ),
    Intervention(
        "seeing-ahead/2", "nearly as quick as the limits allow: with half the speed limit",
        BASE_10, (0, 0.06), ("limits.velocity_scale=0.5",), (0.4, 0.6), of=("controller=htmpc_wpt",),
    ),
    Intervention(
        "seeing-ahead/2", "or a third of the acceleration, it comes home later",
        BASE_10, (0, 0.06), ("limits.acceleration_scale=0.33",), (0.15, 0.25), of=("controller=htmpc_wpt",),
    ),
    Intervention(
        "seeing-ahead/2", "and comes home as late as before",
        BASE_10, (0.85, 0.95), ("limits.velocity_scale=0.5",), (0.85, 0.95), stays=True,
    ),
    Intervention(
        "seeing-ahead/2", "and comes home as late as before",
        BASE_10, (0.85, 0.95), ("limits.acceleration_scale=0.33",), (0.85, 0.95), stays=True,
    ),
    Intervention(
        "further/seeing-ahead", r"With a thousandth of this $\rho$ the difference disappears.",
        of("error/base", "m", "mean", 15.9), (0.15, 0.17), ("rho=1e-5",), (0.13, 0.14), on="seeing-ahead/2",
    ),
    Intervention(
        "seeing-ahead/3", "the faster base and arm move, the further the hand drifts",
        EE, (15, 25), ("gains=[2,0.3]",), (0, 6), seconds=4.0,
    ),
    Intervention(
        "seeing-ahead/3", "If velocities are computed a hundred times a second, the hand drifts half as far.",
        EE, (15, 25), ("rate_hz=100",), (6, 14), seconds=4.0,
    ),
    Intervention(
        "seeing-ahead/3", "with 5 1/s for the hand its error is half as large",
        EE, (15, 25), ("gains=[5,2]",), (7, 13), seconds=4.0,
    ),
    Intervention(
        "seeing-ahead/3", "with 20 1/s it is 3 mm", EE, (15, 25), ("gains=[20,2]",), (2, 4),
    ),
    Intervention(
        "seeing-ahead/3", "the base is as quick as before",
        of("error/base", "m", "mean", 8.0), (0.18, 0.21), ("gains=[20,2]",), (0.18, 0.21), stays=True,
    ),

    # ---------------------------------------- told-wrong
    Intervention(
        "told-wrong/0", "it leaves its line by 57 cm",
        of("error/base", "m"), (0.565, 0.575), ("false_report=false",), (0, 0.005),
    ),
    Intervention(
        "told-wrong/0", "the hand stays within half a millimetre of its own",
        EE, (0.3, 0.5), ("order=base,ee",), (470, 490),
    ),
    Intervention(
        "told-wrong/0", "with the base first the hand swings out by 48 cm",
        EE, (475, 485), ("false_report=false",), (0, 5), of=("order=base,ee",),
    ),
    Intervention(
        "told-wrong/0", "from 9 s on the base is within 2 cm of its line",
        of("error/base", "m", "largest", 9.0), (0.005, 0.02), ("report_end=12",), (0.1, 0.2),
    ),
    Intervention(
        "told-wrong/0", "at 12 s its base is still 71 cm away",
        of("error/base", "m", "mean", 11.85), (0.705, 0.715), ("controller=htmpc",), (0, 0.005),
        of=("controller=stmpc",),
    ),
    Intervention(
        "told-wrong/1",
        "The robot drives 40 cm into the crate", DEEP, (-0.405, -0.395), ("report_end=5",), KEPT,
    ),
    Intervention(
        "told-wrong/1", "until 7 s its base is never more than 3 mm from its line",
        of("error/base", "m", "largest", until=7.0), (0.001, 0.003), ("false_report=false",), (0.5, 0.6),
    ),
    Intervention(
        "told-wrong/1", "A correction at 5 s is early enough: 5 cm are kept", DEEP, KEPT, ("report_end=5.6",),
        (-0.075, -0.065), of=("report_end=5",),
    ),
    Intervention(
        "told-wrong/1", "A correction at 5.4 s is nearly too late: 2 cm are left",
        DEEP, (0.015, 0.025), ("report_end=5",), KEPT, of=("report_end=5.4",),
    ),
    Intervention(
        "told-wrong/1", "The hand swings out by 12 cm meanwhile",
        EE, (115, 125), ("report_end=5",), (0, 1), of=("report_end=5.4",),
    ),
    Intervention(
        "told-wrong/1", "A correction at 5.6 s is too late: the robot overlaps the crate by 7 cm",
        DEEP, (-0.075, -0.065), ("report_end=5",), KEPT, of=("report_end=5.6",),
    ),

    # ---------------------------------------- your-robot
    Intervention(
        "your-robot/0", "the orientation as far as five joints allow",
        TILT, (11, 12), ("levels.orientation.enabled=false",), (17, 20),
    ),
    Intervention(
        "further/your-robot", "Two degrees of freedom cannot reach all three coordinates of the orientation",
        TILT, (11, 12), ("levels.position.enabled=false",), (0, 1), on="your-robot/0",
    ),
    Intervention(
        "your-robot/0", "no motion is left for the posture",
        of("error/posture", "deg", "last"), (20, 30),
        ("levels.position.enabled=false", "levels.orientation.enabled=false"), (0, 1),
    ),
    Intervention(
        "your-robot/0", "In a weighted sum the position has an error instead",
        of("error/position", "mm", "last"), (90, 120), ("controller=himpc",), (0, 0.2),
        of=("controller=weighted",),
    ),
    Intervention(
        "your-robot/1", "its springs must carry the additional weight",
        of("error/position", "mm", "last"), (10, 100),
        ("nominal.mass_scale=1.5", "nominal.inertia_scale=1.5"),
        (0, 0.2), of=("controller=hqp",), seconds=0.3,
    ),
    Intervention(
        "further/your-robot",
        "The small eigenvalues become smaller, so slow components are corrected even more slowly. The "
        "heavier robot is safer, but less accurate.",
        HAND, (9, 16), ("plant.mass_scale=1", "plant.inertia_scale=1"), (5, 8.5), on="your-robot/1",
    ),
)
# fmt: on

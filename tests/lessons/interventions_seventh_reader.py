"""Interventions for the sentences that replaced those which a seventh independent reader had refuted."""

from __future__ import annotations

from functools import partial

from interventions import Intervention, of

EE = of("error/ee", "mm")
FORCE = of("contact_force", "N", "last")
SPEED = of("speed share", "%", "largest", 2.0)
SWING = of("v", "deg/s", "largest", 2.0, 5.0, column=4)
MOTORS_ONLY = ("limits.torque=false",)
STIFF = ("controller=osf", "levels.position.K_p=765", "levels.position.K_v=55.3")
SOFT = ("levels.position.K_p=56.2", "levels.position.K_v=15")
UNREST = partial(Intervention, "a-blind-arm/2")
OSF_BOUNCES = partial(
    Intervention, "further/a-blind-arm", of=STIFF, without=SOFT, on="a-blind-arm/0", seconds=3.0
)

# fmt: off
SEVENTH_ROWS = (
    # ---------------------------------------- a-blind-arm
    Intervention(
        "a-blind-arm/0", "After an impact the ghost acts like a spring: for one centimetre of error",
        FORCE, (3.6, 4.4), ("levels.position.K_p=28.1",), (1.7, 2.3), of=("controller=osf",),
    ),
    *(
        UNREST(says=says, measure=SWING, there=(80, 105), without=MOTORS_ONLY, gone=(0, 5))
        for says in (
            "With two joints at their bounds the elbow swings four times a second",
            "The bound inside the QPs is the cause",
        )
    ),
    UNREST(
        says="After 6 s the wrist gives way, and joints pass their speed limits",
        measure=of("speed share", "%", "largest", 6.0), there=(150, 2000), without=MOTORS_ONLY, gone=(0, 10),
    ),
    UNREST(
        says="After 6 s the wrist gives way",
        measure=of("q", "deg", "range", 6.0, column=5), there=(40, 200), without=MOTORS_ONLY, gone=(0, 5),
    ),
    UNREST(
        says="the ghost stays at rest", measure=SPEED, there=(150, 2000), without=MOTORS_ONLY, gone=(0, 15),
    ),
    UNREST(
        says="with joint 2 at the limit of its motor",
        measure=of("tau", "N·m", "mean", 5.0, column=1), there=(-81, 81), without=MOTORS_ONLY,
        gone=(319.9, 320.1),
    ),
    UNREST(
        says="The horizon is not the cause: with $N = 1$ the elbow swings as well",
        measure=SWING, there=(60, 105), without=("horizon=1",), gone=(60, 105), stays=True,
    ),
    OSF_BOUNCES(
        says="joints pass their speed limits after the impact",
        measure=of("speed share", "%", "largest", 1.0), there=(150, 2000), gone=(0, 20),
    ),
    OSF_BOUNCES(
        says="the hand comes to rest 5 cm beside its target",
        measure=of("error/position", "mm", "last"), there=(45, 55), gone=(8, 13),
    ),
    # ---------------------------------------- told-wrong
    Intervention(
        "told-wrong/1",
        "because the base's acceleration may change by at most 10 m/s³: without this bound it swings out by "
        "3 cm",
        EE, (115, 125), ("limits.jerk_limit=[1e3,1e3,1e3,80,80,80,80,80,80]",), (25, 35),
        of=("report_end=5.4",),
    ),
)
# fmt: on

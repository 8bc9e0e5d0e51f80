"""Interventions for the causes in the lessons on tasks, priorities and singular poses, in the order of the
course."""

from __future__ import annotations

from interventions import Intervention, of

HAND = of("error/position", "mm")
Q1 = of("error/q1", "deg")
TILT = of("error/orientation", "deg", "last")
RADIUS = of("gauge_radius")
NO_FRICTION = ("plant.friction=0", "plant.damping=0")
NO_BOUNDS = (
    "limits.torque_scale=1000",
    "plant.saturate=false",
    "limits.velocity=false",
    "limits.position=off",
)
INF = float("inf")
EXACT = (
    "nominal.mass_scale=1",
    "nominal.inertia_scale=1",
    "nominal.armature=[0.05,0.05,0.03]",
    "nominal.damping=[0.15,0.1,0.08]",
)

# fmt: off
TASK_ROWS = (
    # ---------------------------------------- a-redundant-arm
    Intervention(
        "a-redundant-arm/0", "All seven joints take part",
        of("q", "deg", "range", column=6), (5, 30), ("levels.orientation.enabled=false",), (0, 1),
    ),
    Intervention(
        "a-redundant-arm/1",
        "Joint 3 stops at 29°, because the same level has to hold the other six joints",
        of("q", "deg", "range", column=2), (28.5, 29.5), ("tasks.posture.K_p=[0,0,56.2,0,0,0,0]",), (53, 61),
    ),
    Intervention(
        "a-redundant-arm/2", "the hand tilts, because no level holds its orientation",
        TILT, (15, 17), ("levels.orientation.enabled=true",), (0, 0.1),
    ),
    # ---------------------------------------- one-task
    Intervention(
        "one-task/0", "because by then the torques had changed so as to push back",
        of("error/position", "mm", "mean", 0.35, 0.4, column=0), (-2, -0.3), ("controller=osf", *EXACT),
        (5, 90), seconds=0.45,
    ),
    Intervention(
        "one-task/2", "with $\\bar M^{-1} = 30$ here", HAND, (3.6, 4.2), ("R_on=acceleration",), (10, 40),
    ),
    Intervention(
        "one-task/3", "0.2 s later joint 2 turns with 80°/s in the opposite direction",
        of("v", "deg/s", "mean", 0.495, 0.505, column=1), (78, 82), ("limits.velocity=false",), (-500, -200),
        seconds=0.6,
    ),
    Intervention(
        "one-task/3",
        "Without speed limits joint 2 continues in the direction of the push, with more than 300°/s",
        of("v", "deg/s", "mean", 0.3, 0.5, column=1), (-500, -300), ("limits.velocity=true",), (-50, 50),
        of=("limits.velocity=false",), seconds=0.6,
    ),
    Intervention(
        "one-task/3", "No task stops the motion in that direction",
        of("speed share", "%", "largest", 1.0), (50, 101), ("damping=true",), (0, 5),
    ),
    Intervention(
        "one-task/3", "with hardly any effect on the hand",
        HAND, (1.8, 2.8), ("damping=true",), (1.8, 2.8), stays=True,
    ),
    Intervention(
        "one-task/2", "The torque that holds the arm costs nothing",
        of("error/position", "mm", "last"), (0, 0.01), ("levels.position.R=1000",), (0, 0.01),
        on="no-model-needed/0", stays=True,
    ),
    # ---------------------------------------- no-model-needed
    Intervention(
        "no-model-needed/0", "only its springs carry the kilogram, so it sags by centimetres",
        of("error/position", "mm", "last"), (20, 90), ("nominal.payload_kg=1",), (0, 0.1),
        of=("controller=hqp", "plant.payload_kg=1"), seconds=0.4,
    ),
    Intervention(
        "no-model-needed/1", "every millisecond only a part of the error in $\\ddot q$ is removed",
        HAND, (40, 80), ("M_bar_scale=1",), (12, 19),
    ),
    Intervention(
        "no-model-needed/3", "each correction is more than twice as large as it should be",
        RADIUS, (1.05, 9), ("M_bar_scale=4",), (0, 0.99), seconds=0.2,
    ),
    # ---------------------------------------- two-tasks
    Intervention(
        "two-tasks/0", "OSF's model has no friction",
        HAND, (0.7, 1.4), NO_FRICTION, (0, 0.3), of=("controller=osf",), seconds=0.6,
    ),
    Intervention(
        "two-tasks/0", "Priorities matter where a bound limits one of the tasks",
        HAND, (1, 3), ("controller=himpc",), (0, 0.2), of=("controller=weighted",), on="torque-has-a-limit/1",
    ),
    Intervention(
        "two-tasks/1", "So the gains act as weights, too.",
        HAND, (200, 300), ("tasks.q1.K_p=5", "tasks.q1.K_v=1.6"), (5, 150),
    ),
    Intervention(
        "two-tasks/2", "with $Q_2 = 1000$ it does so as well",
        HAND, (0.5, 1.2), ("levels.q1.Q=1000",), (0.5, 1.2), stays=True,
    ),
    Intervention(
        "two-tasks/2", "Without level 2 the hand is off by 0.2 mm", HAND, (0.5, 1.2),
        ("levels.q1.enabled=false",), (0.15, 0.25),
    ),
    Intervention(
        "two-tasks/2", "time-delay estimation has to correct the effects of that motion",
        HAND, (0.7, 1.0), ("M_bar_scale=2",), (0.3, 0.6),
    ),
    Intervention(
        "two-tasks/3", "But such a small $Q$ no longer outweighs $R$.",
        Q1, (8, 20), ("levels.q1.R=0.001", "levels.position.R=0.001"), (0, 0.1),
        of=("q1_amplitude_deg=20", "levels.q1.Q=1e-5"),
    ),
    Intervention(
        "further/two-tasks", "Level 2 then weighs little beside $R$",
        Q1, (0.15, 0.4), ("levels.q1.R=0.1", "levels.position.R=0.1"), (0, 0.05),
        of=("q1_amplitude_deg=20", "levels.q1.Q=1e-3"), on="two-tasks/3", seconds=0.6,
    ),
    # ---------------------------------------- swap-the-priorities
    Intervention(
        "swap-the-priorities/0", "Level 3 may only use torques that satisfy (33)",
        of("error/posture", "deg", "last"), (31.5, 32.5),
        ("levels.position.enabled=false", "levels.orientation.enabled=false"), (0, 0.1),
    ),
    Intervention(
        "swap-the-priorities/2", "The bounds do not explain the smooth motion",
        of("v", "deg/s"), (85, 105), ("limits.velocity=false", "limits.torque=false", "limits.position=off"),
        (85, 105), stays=True,
    ),
    # ---------------------------------------- when-tasks-fight
    Intervention(
        "when-tasks-fight/0", "The algorithm creates the singularity",
        of("torque share", "%"), (1e5, INF), ("controller=osf_damped",), (0, 2000),
    ),

    Intervention(
        "when-tasks-fight/1", "TDEOSF describes the arm better and fails at the same place",
        of("torque share", "%"), (1e5, INF), ("plant.friction=0", *EXACT), (1e5, INF), of=("controller=osf",),
        stays=True,
    ),
    Intervention(
        "when-tasks-fight/1", "OSF's model has no friction",
        HAND, (2, 2.7), NO_FRICTION, (0, 0.3), of=("controller=osf",), seconds=0.5,
    ),
    Intervention(
        "when-tasks-fight/2", "Level 2 has a target that it cannot reach",
        of("v", "deg/s", "range", 2.5, column=2), (170, 200), ("q1_amplitude_deg=20",), (40, 80),
    ),
    Intervention(
        "when-tasks-fight/2", "with twice the $\\bar M$ it swings as before",
        of("v", "deg/s", "range", 2.5, column=2), (170, 200), ("M_bar_scale=2",), (170, 200), stays=True,
    ),
    Intervention(
        "when-tasks-fight/2", "HQP has rows on torque only, none on speed",
        of("speed share", "%"), (300, 700), ("controller=hiqp",), (95, 105), of=("controller=hqp",),
    ),
    Intervention(
        "when-tasks-fight/0", "HIMPC has bounds in its QPs",
        of("tau_demand", "N·m"), (0, 3), NO_BOUNDS, (1000, INF), of=("controller=himpc",),
    ),
    Intervention(
        "when-tasks-fight/1", "HIMPC has bounds in its QPs",
        of("v", "deg/s"), (50, 150), NO_BOUNDS, (2000, INF), of=("controller=himpc",),
    ),
    Intervention(
        "when-tasks-fight/2", "without those on speed and position every motor comes to its limit",
        of("torque share", "%"), (15, 30), NO_BOUNDS[2:], (99, 101), seconds=2.5,
    ),
    Intervention(
        "when-tasks-fight/2", "the hand is off by 11 mm",
        HAND, (0.7, 1), NO_BOUNDS[2:], (10.5, 11.5), seconds=2.5,
    ),
    Intervention(
        "when-tasks-fight/2", "without any bound the arm goes out of control as with a projection",
        HAND, (0.7, 1), NO_BOUNDS, (1000, INF), seconds=2.5,
    ),
    # ---------------------------------------- stretched-out
    Intervention(
        "stretched-out/0", "demands at most half of the limit, even without bounds",
        of("tau_demand", "N·m", column=1), (1, 2), NO_BOUNDS, (1, 2), of=("controller=himpc",), stays=True,
    ),
    Intervention(
        "stretched-out/1", "its model has no friction",
        of("error/position", "mm", "largest", 1.0), (2, 3.5), NO_FRICTION, (0, 0.3), of=("controller=hqp",),
    ),
    Intervention(
        "stretched-out/2", "HQP's model has no friction, whether the start is gentle or not",
        HAND, (0.7, 1.3), NO_FRICTION, (0, 0.3), of=("controller=hqp",), seconds=0.5,
    ),
    Intervention(
        "stretched-out/0", "for a tenth of a second the demanded torque is small",
        of("torque share", "%"), (1e6, INF), ("smooth=true",), (0, 1), seconds=0.1,
    ),
    Intervention(
        "stretched-out/0", "A damped inverse, `osf_damped`, demands a fifth of the limit.",
        of("torque share", "%"), (1e6, INF), ("controller=osf_damped",), (18, 22),
    ),
    Intervention(
        "stretched-out/2", "Nearly all of the error was due to the jump",
        HAND, (2, 10), ("smooth=true",), (0, 0.5), of=("smooth=false",),
    ),
    Intervention(
        "stretched-out/1", "with a million times the $R$ the hand swings by centimetres and more",
        of("error/position", "mm", "largest", 1.0), (50, INF), ("R=1000",), (0, 0.5), of=("R=1e7",),
    ),
    Intervention(
        "stretched-out/1", "at rest the cost of the change is zero, so $R$ need not be small for accuracy",
        of("error/position", "mm", "largest", 1.0), (0.15, 0.3), ("R=1000",), (0.15, 0.3), stays=True,
    ),
    Intervention(
        "further/stretched-out", "the run with $R = 10^7$ swings by decimetres",
        of("error/position", "mm", "range", 1.0), (100, 900), ("R=1e5",), (0, 5),
        of=("R=1e7",), on="stretched-out/1",
    ),
    Intervention(
        "further/stretched-out",
        "is why the ghost performs equally well: no tuning is needed between the two values",
        of("error/position", "mm", "largest", 1.0), (0.15, 0.3), ("R=1000",), (0.15, 0.3),
        on="stretched-out/1", stays=True,
    ),
    Intervention(
        "further/stretched-out",
        "is why the ghost performs equally well: no tuning is needed between the two values",
        of("error/position", "mm", "largest", 1.0), (0.15, 0.3), ("R=1e5",), (0.5, 50), of=("R=1000",),
        on="stretched-out/1",
    ),
)
# fmt: on

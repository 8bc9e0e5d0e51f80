"""What the lessons say of causes, in the order of the course."""

from __future__ import annotations

from interventions import Intervention, of

HAND, EE = of("error/position", "mm"), of("error/ee", "mm")
Q1 = of("error/q1", "deg")
RADIUS = of("gauge_radius")
SPEED = of("speed share", "%")
NO_LIMITS = ("limits.velocity=false", "limits.acceleration=false", "limits.jerk=false")
X = of("error/position", "mm", "rms", column=0)
TILT = of("error/orientation", "deg", "last")
BASE_10 = of("error/base", "m", "mean", 10.0, 10.2)
NO_FRICTION = ("plant.friction=0", "plant.damping=0")
NO_BOUNDS = (
    "limits.torque_scale=1000",
    "plant.saturate=false",
    "limits.velocity=false",
    "limits.position=off",
)
JOINT_2 = of("q", "deg", column=1)
INF = float("inf")
EXACT = (
    "nominal.mass_scale=1",
    "nominal.inertia_scale=1",
    "nominal.armature=[0.05,0.05,0.03]",
    "nominal.damping=[0.15,0.1,0.08]",
)

# fmt: off
COURSE_ROWS = (
    # ---------------------------------------- a-redundant-arm
    Intervention(
        "a-redundant-arm/0", "All seven joints take part",
        of("q", "deg", "range", column=6), (5, 30), ("levels.orientation.enabled=false",), (0, 1),
    ),
    Intervention(
        "a-redundant-arm/1", "only the part of the wish that lies in the null space is granted",
        of("q", "deg", "range", column=2), (27, 31),
        ("levels.position.enabled=false", "levels.orientation.enabled=false"), (57, 61),
    ),
    # ---------------------------------------- one-task
    Intervention(
        "one-task/0", "because by then the torques had changed so as to push back",
        of("error/position", "mm", "mean", 0.35, 0.4, column=0), (-2, -0.3), ("controller=osf", *EXACT),
        (5, 90),
    ),
    Intervention(
        "one-task/2", "with $\\bar M^{-1} = 30$ here", HAND, (3.6, 4.2), ("R_on=acceleration",), (10, 40),
    ),
    Intervention(
        "one-task/3", "0.2 s later it does 80°/s the other way",
        of("v", "deg/s", "mean", 0.495, 0.505, column=1), (78, 82), ("limits.velocity=false",), (-500, -200),
        seconds=0.6,
    ),
    Intervention(
        "one-task/3", "Without speed limits joint 2 goes on the way it was pushed, with more than 300°/s",
        of("v", "deg/s", "mean", 0.3, 0.5, column=1), (-500, -300), ("limits.velocity=true",), (-50, 50),
        of=("limits.velocity=false",), seconds=0.6,
    ),
    Intervention(
        "one-task/3", "Nothing asks that direction to stop",
        of("speed share", "%", "largest", 1.0), (50, 101), ("damping=true",), (0, 5),
    ),
    Intervention(
        "one-task/3", "the hand hardly notices", HAND, (1.8, 2.8), ("damping=true",), (1.8, 2.8), stays=True,
    ),
    Intervention(
        "one-task/2", "The torque that holds the arm costs nothing",
        of("error/position", "mm", "last"), (0, 0.01), ("levels.position.R=1000",), (0, 0.01),
        on="no-model-needed/0", stays=True,
    ),
    # ---------------------------------------- no-model-needed
    Intervention(
        "no-model-needed/0", "its springs hold that, so it sags by centimetres",
        of("error/position", "mm", "last"), (20, 90), ("nominal.payload_kg=1",), (0, 0.1),
        of=("controller=hqp",),
    ),
    Intervention(
        "no-model-needed/1", "every millisecond only a part of the error in $\\ddot q$ is removed",
        HAND, (40, 80), ("M_bar_scale=1",), (12, 19),
    ),
    Intervention(
        "no-model-needed/3", "each correction is more than twice too large",
        RADIUS, (1.05, 9), ("M_bar_scale=4",), (0, 0.99), seconds=0.2,
    ),
    # ---------------------------------------- two-tasks
    Intervention(
        "two-tasks/0", "its model knows no friction",
        HAND, (2.5, 3.2), NO_FRICTION, (0, 0.3), of=("controller=osf",),
    ),
    Intervention(
        "two-tasks/0", "They still do wherever a bound is in the way of one of them",
        HAND, (1, 3), ("controller=himpc",), (0, 0.2), of=("controller=weighted",), on="torque-has-a-limit/1",
    ),
    Intervention(
        "two-tasks/1", "So the gains are prices, too.",
        HAND, (200, 300), ("tasks.q1.K_p=5", "tasks.q1.K_v=1.6"), (5, 150),
    ),
    Intervention(
        "two-tasks/2", "no weight of level 2 can change that",
        HAND, (0.5, 1.2), ("levels.q1.Q=1000",), (0.5, 1.2), stays=True,
    ),
    Intervention(
        "two-tasks/2", "Without level 2 the hand errs by 0.2 mm", HAND, (0.5, 1.2),
        ("levels.q1.enabled=false",), (0.15, 0.25),
    ),
    Intervention(
        "two-tasks/2", "time-delay estimation has to correct what that motion changes",
        HAND, (0.7, 1.0), ("M_bar_scale=2",), (0.3, 0.6),
    ),
    Intervention(
        "two-tasks/3", "But a $Q$ that small has to outweigh $R$ as well.",
        Q1, (8, 20), ("levels.q1.R=0.001", "levels.position.R=0.001"), (0, 0.1),
        of=("q1_amplitude_deg=20", "levels.q1.Q=1e-5"),
    ),
    Intervention(
        "further/two-tasks", "Level 2 then weighs little beside $R$",
        Q1, (0.15, 0.4), ("levels.q1.R=0.1", "levels.position.R=0.1"), (0, 0.05),
        of=("q1_amplitude_deg=20", "levels.q1.Q=1e-3"), on="two-tasks/3",
    ),
    # ---------------------------------------- swap-the-priorities
    Intervention(
        "swap-the-priorities/0", "Level 3 may only use torques that satisfy (33)",
        of("error/posture", "deg", "last"), (31.5, 32.5),
        ("levels.position.enabled=false", "levels.orientation.enabled=false"), (0, 0.1),
    ),
    Intervention(
        "swap-the-priorities/2", "It is not the bounds that keep it calm",
        of("v", "deg/s"), (85, 105), ("limits.velocity=false", "limits.torque=false", "limits.position=off"),
        (85, 105), stays=True,
    ),
    # ---------------------------------------- when-tasks-fight
    Intervention(
        "when-tasks-fight/0", "The singularity is made by the algorithm",
        of("torque share", "%"), (1e5, INF), ("controller=osf_damped",), (0, 2000),
    ),
    Intervention(
        "when-tasks-fight/1", "Damped, the inverse comes through.",
        of("torque share", "%"), (1e5, INF), ("controller=tdeosf_damped",), (0, 2000),
    ),
    Intervention(
        "when-tasks-fight/1", "It knows the arm better and fails at the same place",
        of("torque share", "%"), (1e5, INF), ("plant.friction=0", *EXACT), (1e5, INF), of=("controller=osf",),
        stays=True,
    ),
    Intervention(
        "when-tasks-fight/1", "its model knows no friction",
        of("error/position", "mm", "largest", 0.0, 1.0), (3, 4), NO_FRICTION, (0, 0.3),
        of=("controller=osf",),
    ),
    Intervention(
        "when-tasks-fight/2", "Level 2 wants something it cannot have",
        of("v", "deg/s", "range", 2.5, column=2), (170, 200), ("q1_amplitude_deg=20",), (40, 80),
    ),
    Intervention(
        "when-tasks-fight/2", "HQP has rows on torque only, none on speed",
        of("speed share", "%"), (300, 700), ("controller=hiqp",), (95, 105), of=("controller=hqp",),
    ),
    Intervention(
        "when-tasks-fight/0", "bounds are part of the problem",
        of("tau_demand", "N·m"), (0, 3), NO_BOUNDS, (1000, INF), of=("controller=himpc",),
    ),
    Intervention(
        "when-tasks-fight/1", "bounds are part of the problem",
        of("v", "deg/s"), (50, 150), NO_BOUNDS, (2000, INF), of=("controller=himpc",),
    ),
    Intervention(
        "when-tasks-fight/2", "without those on speed and position every motor comes to its limit",
        of("torque share", "%"), (15, 30), NO_BOUNDS[2:], (99, 101),
    ),
    Intervention(
        "when-tasks-fight/2", "the hand is off by 11 mm",
        HAND, (0.7, 1), NO_BOUNDS[2:], (10.5, 11.5),
    ),
    Intervention(
        "when-tasks-fight/2", "without any bound the arm is lost as with a projection",
        HAND, (0.7, 1), NO_BOUNDS, (1000, INF),
    ),
    # ---------------------------------------- stretched-out
    Intervention(
        "stretched-out/0", "nothing is inverted: without any bound it asks for no more than half",
        of("tau_demand", "N·m", column=1), (1, 2), NO_BOUNDS, (1, 2), of=("controller=himpc",), stays=True,
    ),
    Intervention(
        "stretched-out/1", "its model knows no friction",
        of("error/position", "mm", "largest", 1.0), (2, 3.5), NO_FRICTION, (0, 0.3), of=("controller=hqp",),
    ),
    Intervention(
        "stretched-out/2", "its model knows no friction, smooth or not",
        HAND, (1.5, 2.5), NO_FRICTION, (0, 0.3), of=("controller=hqp",),
    ),
    Intervention(
        "stretched-out/0", "for a tenth of a second the demand is small",
        of("torque share", "%", "largest", 0.0, 0.1), (1e6, INF), ("smooth=true",), (0, 1),
    ),
    Intervention(
        "stretched-out/0", "A damped inverse, `osf_damped`, asks for a fifth of the limit.",
        of("torque share", "%"), (1e6, INF), ("controller=osf_damped",), (18, 22),
    ),
    Intervention(
        "stretched-out/2", "Nearly all of it was the jump",
        HAND, (2, 10), ("smooth=true",), (0, 0.5), of=("smooth=false",),
    ),
    Intervention(
        "stretched-out/1", "with a million times the hand swings by centimetres and more",
        of("error/position", "mm", "largest", 1.0), (50, INF), ("R=1000",), (0, 0.5), of=("R=1e7",),
    ),
    Intervention(
        "further/stretched-out", "the run with $R = 10^7$ swings by decimetres",
        of("error/position", "mm", "range", 1.0), (100, 900), ("R=1e5",), (0, 5),
        of=("R=1e7",), on="stretched-out/1", seconds=4.0,
    ),
    Intervention(
        "further/stretched-out", "is why the ghost does as well: between the two lies no tuning",
        of("error/position", "mm", "largest", 1.0), (0.15, 0.3), ("R=1000",), (0.15, 0.3),
        on="stretched-out/1", stays=True,
    ),
    Intervention(
        "further/stretched-out", "is why the ghost does as well: between the two lies no tuning",
        of("error/position", "mm", "largest", 1.0), (0.15, 0.3), ("R=1e5",), (0.5, 50), of=("R=1000",),
        on="stretched-out/1",
    ),
    # ---------------------------------------- torque-has-a-limit
    Intervention(
        "torque-has-a-limit/0", "A bound that is not met does nothing",
        HAND, (0.03, 0.07), ("limits.torque_scale=1",), (0.03, 0.07), stays=True,
    ),
    Intervention(
        "torque-has-a-limit/1", "With joint 1 first it is the hand that goes without, by 1.6 mm",
        HAND, (0, 0.1), ("order=q1,position",), (1.55, 1.7),
    ),
    Intervention(
        "torque-has-a-limit/1", "joint 1 does not notice",
        Q1, (0.45, 0.65), ("order=q1,position",), (0, 0.05),
    ),
    Intervention(
        "torque-has-a-limit/1", "the order makes no difference",
        Q1, (9, 13), ("order=q1,position",), (9, 13), of=("q1_amplitude_deg=60",), stays=True,
    ),
    Intervention(
        "torque-has-a-limit/2", "for with joint 1 first it is the same",
        HAND, (8, 12), ("order=q1,position",), (8, 12), stays=True,
    ),
    Intervention(
        "torque-has-a-limit/2", "16 mm instead of 10, since level 2 has moved joint 1 meanwhile",
        HAND, (15.5, 17), ("levels.q1.enabled=false",), (9.5, 11), of=("q1_amplitude_deg=-30",),
    ),
    Intervention(
        "torque-has-a-limit/0", "that is too little for level 1 alone",
        HAND, (0.5, 30), ("levels.q1.enabled=false",), (0.5, 30), of=("limits.torque_scale=0.03",),
        stays=True,
    ),
    # ---------------------------------------- stopping-takes-distance
    Intervention(
        "stopping-takes-distance/0", "overruns its range by 0.6°",
        JOINT_2, (150.55, 150.75),
        ("limits.torque_scale=3", "plant.saturate=false", "limits.velocity=false"), (149, 150.2),
    ),
    Intervention(
        "stopping-takes-distance/0", "with the rows on speed off as well only 0.1° is left",
        JOINT_2, (150.05, 150.15), ("limits.torque_scale=1", "plant.saturate=true"), (150.4, 151),
        of=("limits.torque_scale=3", "plant.saturate=false", "limits.velocity=false"),
    ),
    Intervention(
        "stopping-takes-distance/0",
        "With three times the torque, in the bounds and in the motors, 0.2° is left",
        JOINT_2, (150.55, 150.75), ("limits.torque_scale=3", "plant.saturate=false"), (150.15, 150.25),
    ),
    Intervention(
        "stopping-takes-distance/2", "The price is time: the last degrees are crept",
        of("q", "deg", "mean", 1.6, 1.7, column=1), (147.5, 148.7), ("limits.velocity_approach=0",),
        (149.5, 149.7),
    ),
    # ---------------------------------------- how-far-ahead
    Intervention(
        "how-far-ahead/0", "a longer horizon sees the ends of the joints' ranges sooner",
        X, (0.56, 0.57), ("horizon=30",), (0.528, 0.538), of=("horizon=5",), on="iiwa14-circle-paper",
        seconds=4.0,
    ),
    Intervention(
        "how-far-ahead/0", "a longer horizon sees the ends of the joints' ranges sooner",
        X, (0.47, 0.475), ("horizon=30",), (0.47, 0.475), of=("horizon=5", "limits.position=off"),
        on="iiwa14-circle-paper", seconds=4.0, stays=True,
    ),
    Intervention(
        "how-far-ahead/0", "Twice the $\\bar M$ halves the error; no horizon does that.",
        of("error/position", "mm", "rms"), (0.75, 1.0), ("M_bar_scale=2",), (0.3, 0.55),
    ),
    Intervention(
        "how-far-ahead/1", "so no step removes all of $e$",
        of("error/position", "mm", "rms"), (0.75, 1.1), ("R_on=acceleration",), (1.2, 9),
        of=("R_on=torque", "horizon=1"),
    ),
    # ---------------------------------------- deadlines
    Intervention(
        "deadlines/0", "every single torque is one tick late", HAND, (3, 4), ("deadline_ms=0",), (1.2, 1.7),
    ),
    Intervention(
        "deadlines/0", "each sequence is a control loop of half the rate",
        HAND, (3, 4), ("T_s=0.002", "deadline_ms=2"), (3, 4), stays=True,
    ),
    Intervention(
        "deadlines/1", "The error grows with the period", HAND, (3, 4), ("T_s=0.005", "deadline_ms=5"),
        (7, 15),
    ),
    Intervention(
        "deadlines/2", "noise counts double",
        of("delta_tau", "N·m", "rms"), (1.1, 1.6), ("M_bar_scale=1",), (0.5, 0.8),
        of=("plant.encoder_resolution_deg=0.001",),
    ),
    # ---------------------------------------- sensors-are-coarse
    Intervention(
        "sensors-are-coarse/0", "With finer encoders the noise goes in proportion.",
        of("delta_tau", "N·m", "rms"), (3.2, 4.4), ("plant.encoder_resolution_deg=0.0025",), (1.6, 2.2),
    ),
    Intervention(
        "sensors-are-coarse/1", "half of it leaves half of the noise",
        of("delta_tau", "N·m", "rms"), (3.2, 4.4), ("M_bar_scale=0.5",), (1.6, 2.2), of=("T_s=0.001",),
    ),
    Intervention(
        "sensors-are-coarse/1", "again the error grows by little more than half",
        HAND, (0.088, 0.102), ("M_bar_scale=0.5",), (0.138, 0.165), of=("T_s=0.001",),
    ),
    Intervention(
        "sensors-are-coarse/0", "there the noise alone uses up the torque",
        HAND, (20, 200), ("limits.torque_scale=10", "plant.saturate=false"), (0, 0.5),
        of=("plant.encoder_resolution_deg=0.02",),
    ),
    Intervention(
        "sensors-are-coarse/1", "ten times the period is too slow for the circle",
        HAND, (0.5, 0.7), ("plant.encoder_resolution_deg=0",), (0.5, 0.7), of=("T_s=0.01",), stays=True,
    ),
    Intervention(
        "sensors-are-coarse/1", "its torque is smoother, and its model knows no friction",
        HAND, (1, 1.4), NO_FRICTION, (0, 0.3), of=("controller=osf",),
    ),
    # ---------------------------------------- the-model-is-wrong
    Intervention(
        "the-model-is-wrong/0", "time-delay estimation only what has happened",
        HAND, (0.009, 0.014), ("T_s=0.0005",), (0.004, 0.007), of=("controller=himpc",),
    ),
    Intervention(
        "the-model-is-wrong/1", "here that is mostly the friction",
        HAND, (1.0, 2.5), ("plant.friction=0",), (0, 0.3),
    ),
    Intervention(
        "the-model-is-wrong/1", "here that is mostly the friction",
        HAND, (1.0, 2.5),
        ("nominal.mass_scale=1", "nominal.inertia_scale=1", "nominal.armature=[0.05,0.05,0.03]"), (1.0, 2.5),
        stays=True,
    ),
    Intervention(
        "the-model-is-wrong/2", "A larger $\\bar M$ makes the whole error as small as before",
        HAND, (0.047, 0.06), ("M_bar_scale=1.3",), (0.03, 0.044),
    ),
    Intervention(
        "the-model-is-wrong/2", "Lighter links make corrections faster and the error smaller",
        HAND, (0.03, 0.0405), ("plant.mass_scale=1", "plant.inertia_scale=1"), (0.041, 0.05),
        of=("plant.mass_scale=0.5", "plant.inertia_scale=0.5"),
    ),
    Intervention(
        "the-model-is-wrong/2",
        "the inertia of the motors is left: with links of a twentieth the gauge reads 0.47",
        RADIUS, (0.465, 0.475), ("plant.armature=0.01",), (1.2, 4),
        of=("plant.mass_scale=0.05", "plant.inertia_scale=0.05"), seconds=0.5,
    ),
    Intervention(
        "the-model-is-wrong/2", "for links of this weight so large an M̄ is beyond the cliff",
        RADIUS, (1.5, 4), ("plant.mass_scale=10", "plant.inertia_scale=10"), (0.5, 0.98),
        of=("M_bar_scale=4",), seconds=0.5,
    ),
    Intervention(
        "the-model-is-wrong/2", "its model knows no friction",
        HAND, (1, 2), NO_FRICTION, (0, 0.3), of=("controller=hqp",),
    ),
    Intervention(
        "further/the-model-is-wrong", "That is why most of OSF's error in *As identified* is friction's",
        HAND, (1.0, 2.5), ("plant.friction=0",), (0, 0.3), on="the-model-is-wrong/1",
    ),
    # ---------------------------------------- inside-the-qp
    Intervention(
        "inside-the-qp/3", "Time-delay estimation notices it at the next tick and corrects it",
        of("error/reach", "mm", "rms", 1.0), (0, 0.05), ("controller=hqp",), (0.5, 2),
    ),
    Intervention(
        "inside-the-qp/3", "over tens of ticks",
        of("gauge_radius", "", "mean"), (0.9, 0.92), ("M_bar_scale=2",), (0.82, 0.84),
    ),
    # ---------------------------------------- first-hold-then-reach
    Intervention(
        "first-hold-then-reach/0", "priorities say who may be disturbed meanwhile",
        EE, (0, 0.1), ("order=base,ee",), (100, 140),
    ),
    Intervention(
        "first-hold-then-reach/2", "the hand is left behind by exactly these 1.63 m",
        of("error/ee", "m", "mean", 8.5), (1.625, 1.635), ("levels.base.enabled=false",), (0, 0.01),
    ),
    Intervention(
        "first-hold-then-reach/1", "it is where no plan is left that makes $\\mathcal J_2$ smaller",
        of("error/base", "m", "mean", 7.0), (1.55, 1.7), ("order=base,ee",), (0, 0.05),
    ),
    # ---------------------------------------- how-strict-is-strict
    Intervention(
        "how-strict-is-strict/0", "with $\\delta = 0$ the line search halves and halves",
        of("way of the base", "m"), (0, 0.01), ("delta_m=0.001",), (1.0, 3.0),
    ),
    Intervention(
        "how-strict-is-strict/1",
        "the errors that the old plan allowed at its later knots never happen",
        EE, (0.4, 1.4), ("rate_hz=2",), (2.0, 8.0),
    ),
    Intervention(
        "how-strict-is-strict/2", "its gradient says little about which way is harmful",
        of("step/base", "", "mean"), (0.015, 0.03), ("formulation=paper",), (0.045, 0.2),
    ),
    Intervention(
        "how-strict-is-strict/3", "its own best plan lets the hand slip a little",
        EE, (12, 20), ("velocity_effort=0.001",), (2, 9),
    ),
    Intervention(
        "how-strict-is-strict/3", "$\\delta$ comes on top", EE, (12, 20), ("delta_m=0.001",), (2, 9),
    ),
    # ---------------------------------------- seeing-ahead
    Intervention(
        "seeing-ahead/0", "it cannot leave for a place that it does not know of",
        of("way of the base", "m", "range", 6.5, 8.0), (0, 0.05), ("controller=htmpc",), (0.4, 0.8),
        of=("controller=htmpc_wpt",), seconds=8.0,
    ),
    Intervention(
        "seeing-ahead/1", "Without the bound on that change the same 0.2 s are enough for 6 mm",
        EE, (25, 40), ("limits.jerk=false",), (5.5, 6.9),
    ),
    Intervention(
        "seeing-ahead/1", "with half the top speed for 4 mm", EE, (25, 40), ("limits.velocity_scale=0.5",),
        (3.5, 4.5),
    ),
    Intervention(
        "seeing-ahead/1", "three times the acceleration hardly helps",
        EE, (20, 40), ("limits.acceleration_scale=3",), (20, 40), stays=True,
    ),
    Intervention(
        "seeing-ahead/2", "without any limit on speed and acceleration it is hardly nearer home",
        of("error/base", "m", "mean", 15.9), (0.14, 0.17), NO_LIMITS, (0.14, 0.17), stays=True,
    ),
    Intervention(
        "seeing-ahead/2", "with a gain of 2 1/s it arrives",
        of("error/base", "m", "mean", 15.9), (0.14, 0.17), ("gains=[0.5,2]",), (0, 0.01),
    ),
    Intervention(
        "seeing-ahead/2", "nearly as quick as the limits let it be",
        BASE_10, (0, 0.06), ("limits.velocity_scale=0.5",), (0.4, 0.6), of=("controller=htmpc_wpt",),
    ),
    Intervention(
        "seeing-ahead/2", "later with half the speed or a third of the acceleration",
        BASE_10, (0, 0.06), ("limits.acceleration_scale=0.33",), (0.15, 0.25), of=("controller=htmpc_wpt",),
    ),
    Intervention(
        "seeing-ahead/2", "where HTIDKC comes home as late as before",
        BASE_10, (0.85, 0.95), ("limits.velocity_scale=0.5",), (0.85, 0.95), stays=True,
    ),
    Intervention(
        "seeing-ahead/2", "where HTIDKC comes home as late as before",
        BASE_10, (0.85, 0.95), ("limits.acceleration_scale=0.33",), (0.85, 0.95), stays=True,
    ),
    Intervention(
        "further/seeing-ahead", "With a thousandth of this $\\rho$ the difference goes.",
        of("error/base", "m", "mean", 15.9), (0.15, 0.17), ("rho=1e-5",), (0.13, 0.14), on="seeing-ahead/2",
    ),
    Intervention(
        "seeing-ahead/3", "the faster base and arm move, the further the hand drifts",
        EE, (15, 25), ("gains=[2,0.3]",), (0, 6),
    ),
    Intervention(
        "seeing-ahead/3", "Asked for a hundred times a second it drifts half as far.",
        EE, (15, 25), ("rate_hz=100",), (6, 14),
    ),
    Intervention(
        "seeing-ahead/3", "with 5 1/s for the hand it is off by half", EE, (15, 25), ("gains=[5,2]",),
        (7, 13),
    ),
    Intervention(
        "seeing-ahead/3", "with 20 1/s by 3 mm", EE, (15, 25), ("gains=[20,2]",), (2, 4),
    ),
    Intervention(
        "seeing-ahead/3", "the base is as quick as before",
        of("error/base", "m", "mean", 8.0), (0.18, 0.21), ("gains=[20,2]",), (0.18, 0.21), stays=True,
    ),
    Intervention(
        "seeing-ahead/3", "without any the hand is off by more", EE, (15, 25), NO_LIMITS, (28, 50),
    ),
    # ---------------------------------------- your-robot
    Intervention(
        "your-robot/0", "the orientation as far as five joints can",
        TILT, (11, 12), ("levels.orientation.enabled=false",), (17, 20),
    ),
    Intervention(
        "your-robot/0", "the posture goes without",
        of("error/posture", "deg", "last"), (20, 30),
        ("levels.position.enabled=false", "levels.orientation.enabled=false"), (0, 1),
    ),
    Intervention(
        "your-robot/0", "A weighted sum gives up the position instead",
        of("error/position", "mm", "last"), (90, 120), ("controller=himpc",), (0, 0.2),
        of=("controller=weighted",),
    ),
    Intervention(
        "your-robot/1", "what it does not know of the weight, the springs must carry",
        of("error/position", "mm", "last"), (10, 100),
        ("nominal.mass_scale=1.5", "nominal.inertia_scale=1.5"),
        (0, 0.1), of=("controller=hqp",),
    ),
    Intervention(
        "further/your-robot", "Safer, and less accurate.",
        HAND, (9, 16), ("plant.mass_scale=1", "plant.inertia_scale=1"), (5, 8.5), on="your-robot/1",
    ),
)
# fmt: on

"""What the lessons say of causes, in the order of the course."""

from __future__ import annotations

from interventions import Intervention, of

HAND, EE = of("error/position", "mm"), of("error/ee", "mm")
Q1 = of("error/q1", "deg")
RADIUS = of("gauge_radius")
SPEED = of("speed share", "%")
NO_LIMITS = ("limits.velocity=false", "limits.acceleration=false", "limits.jerk=false")
INF = float("inf")

# fmt: off
COURSE_ROWS = (
    # ---------------------------------------- one-task
    Intervention(
        "one-task/3", "0.2 s later it does 70°/s the other way",
        of("v", "deg/s", "mean", 0.45, 0.5, column=1), (65, 75), ("limits.velocity=false",), (-500, -200),
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
    # ---------------------------------------- two-tasks
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
    # ---------------------------------------- stretched-out
    Intervention(
        "stretched-out/1", "with a million times the hand swings by centimetres and more",
        of("error/position", "mm", "largest", 1.0), (50, INF), ("R=1000",), (0, 0.5), of=("R=1e7",),
    ),
    Intervention(
        "further/stretched-out", "the run with $R = 10^7$ swings by decimetres",
        of("error/position", "mm", "range", 1.0), (100, 900), ("R=1e5",), (0, 5),
        of=("R=1e7",), on="stretched-out/1", seconds=4.0,
    ),
    # ---------------------------------------- deadlines
    Intervention(
        "deadlines/0", "every single torque is one tick late", HAND, (3, 4), ("deadline_ms=0",), (1.2, 1.7),
    ),
    Intervention(
        "deadlines/0", "it is a loop of half the rate",
        HAND, (3, 4), ("T_s=0.002", "deadline_ms=2"), (3, 4), stays=True,
    ),
    Intervention(
        "deadlines/2", "noise counts double",
        of("delta_tau", "N·m", "rms"), (1.1, 1.6), ("M_bar_scale=1",), (0.5, 0.8),
        of=("plant.encoder_resolution_deg=0.001",),
    ),
    # ---------------------------------------- the-model-is-wrong
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
        "the-model-is-wrong/2", "a larger $\\bar M$ takes it back",
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
    # ---------------------------------------- how-strict-is-strict
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
        "further/seeing-ahead", "With a thousandth of this $\\rho$ the difference goes.",
        of("error/base", "m", "mean", 15.9), (0.15, 0.17), ("rho=1e-5",), (0.13, 0.14), on="seeing-ahead/2",
    ),
    Intervention(
        "seeing-ahead/3", "the faster the base, the further the hand drifts",
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
)
# fmt: on

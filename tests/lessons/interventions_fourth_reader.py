"""Interventions for the sentences that replaced those which a fourth independent reader had refuted or found
half true."""

from __future__ import annotations

from functools import partial

from interventions import Intervention, of

HAND, EE = of("error/position", "mm"), of("error/ee", "mm")
HAND_RMS = of("error/position", "mm", "rms")
HAND_LAST = of("error/position", "mm", "last")
TORQUE, SPEED = of("torque share", "%"), of("speed share", "%")
WAY = of("way of the base", "m")
JOINT_2 = of("q", "deg", column=1)
MOTOR_1 = of("tau_demand", "N·m", "mean", 0.1, column=0)
LATE = ("T_s=0.001", "deadline_ms=1", "plant.encoder_resolution_deg=0.005")
OFF = ("limits.torque=false", "limits.velocity=false", "limits.position=off")
FIRST = ("order=q1,position",)
NO_ACCELERATION = ("limits.acceleration=false", "limits.jerk=false")
NO_LIMITS = ("limits.velocity=false", *NO_ACCELERATION)
PLANS = partial(Intervention, "how-strict-is-strict/1", measure=EE, there=(0.8, 0.85))
INF = float("inf")

# fmt: off
FOURTH_ROWS = (
    # ---------------------------------------- no-model-needed
    Intervention(
        "no-model-needed/0", "Without a spring, $K_P = 0$, the hand stays 3.3 mm too low",
        HAND_LAST, (0, 0.015), ("tasks.position.K_p=0",), (3.2, 3.4),
    ),
    Intervention(
        "no-model-needed/0", "Then the hand stops sagging",
        HAND_LAST, (3.2, 3.4), ("controller=hqp",), (50, INF), of=("tasks.position.K_p=0",),
    ),
    # ---------------------------------------- when-tasks-fight
    Intervention(
        "when-tasks-fight/1", "With a damped inverse TDEOSF keeps control, with less than four times the",
        SPEED, (360, 400), ("controller=tdeosf",), (2000, INF), of=("controller=tdeosf_damped",),
    ),
    Intervention(
        "when-tasks-fight/1", "OSF does not: a joint passes six times its limit",
        SPEED, (630, 700), ("controller=tdeosf_damped",), (360, 400), of=("controller=osf_damped",),
    ),
    # ---------------------------------------- stretched-out
    Intervention(
        "stretched-out/1",
        "Without bounds $R$ keeps the torque small: with $R = 10^{-5}$ and no bounds HIMPC demands more than",
        of("tau_demand", "N·m"), (1.6, 2.6), ("R=1e-5",), (400, INF), of=OFF,
    ),
    Intervention(
        "stretched-out/1", "With its bounds HIMPC demands 67 % of the limit even with $R = 10^{-12}$",
        TORQUE, (37, 41), ("R=1e-12",), (66, 68),
    ),
    # ---------------------------------------- torque-has-a-limit
    Intervention(
        "torque-has-a-limit/2", "In both orders joint 1's motor is at the same limit nearly all the time",
        MOTOR_1, (0.115, 0.121), FIRST, (0.115, 0.121), stays=True,
    ),
    Intervention(
        "torque-has-a-limit/2", "16 mm instead of 10",
        HAND, (15.5, 17), ("levels.q1.enabled=false",), (9.5, 11), of=("q1_amplitude_deg=-30",),
    ),
    Intervention(
        "torque-has-a-limit/2", "With this swing and joint 1 first the hand is off by 9 mm",
        HAND, (15.5, 17), FIRST, (8.4, 9), of=("q1_amplitude_deg=-30",),
    ),
    # ---------------------------------------- stopping-takes-distance
    Intervention(
        "stopping-takes-distance/0",
        "QPs have no solution in that case either",
        of("unsolved", "", "sum"), (100, 150), ("limits.velocity_scale=0.15",), (100, 150),
        seconds=5.0, stays=True,
    ),
    Intervention(
        "stopping-takes-distance/0", "at 15°/s, where 26 rad/s² are enough, the joint overruns by 0.03° only",
        JOINT_2, (150.55, 150.75), ("limits.velocity_scale=0.15",), (150.025, 150.035),
        seconds=5.0,
    ),
    # ---------------------------------------- how-far-ahead
    Intervention(
        "how-far-ahead/1", "like 1.7 with $N = 1$",
        HAND_RMS, (1.35, 1.6), ("horizon=1", "R=1.7"), (1.35, 1.6), stays=True,
    ),
    # ---------------------------------------- deadlines
    Intervention(
        "deadlines/1",
        "the error of the hand is 47 mm in the late loop, and 3.2 mm in the loop of half the rate",
        HAND, (45, 49), ("T_s=0.002", "deadline_ms=2"), (3.1, 3.3), of=LATE,
    ),
    Intervention(
        "deadlines/1", "without this limit, in the bounds and in the motors, the late hand is off by 3.4 mm",
        HAND, (45, 49), ("limits.torque=false", "plant.saturate=false"), (3.3, 3.5), of=LATE,
    ),
    Intervention(
        "deadlines/1", "if the late controller divides by 2 ms instead, the error is 6.6 mm",
        HAND, (45, 49), ("T_s=0.002",), (6.4, 6.8), of=LATE,
    ),
    # ---------------------------------------- how-strict-is-strict
    Intervention(
        "how-strict-is-strict/0", "with $\\delta = 10^{-12}$ m the base does not move either",
        WAY, (0, 1e-6), ("delta_m=1e-12",), (0, 1e-6), stays=True,
    ),
    Intervention(
        "how-strict-is-strict/0", "with $10^{-6}$ m it drives 14 cm",
        WAY, (0, 1e-6), ("delta_m=1e-6",), (0.135, 0.145),
    ),
    PLANS(
        says="0.8 mm with ten plans a second and a knot every 0.1 s, as here; 6.7 mm with one plan a second",
        without=("rate_hz=1",), gone=(6.6, 6.8),
    ),
    PLANS(says="2.2 mm with five", without=("rate_hz=5",), gone=(2.15, 2.3)),
    PLANS(says="3.5 mm with twenty", without=("rate_hz=20",), gone=(3.4, 3.6)),
    PLANS(says="4.3 mm with fifty", without=("rate_hz=50",), gone=(4.2, 4.4)),
    Intervention(
        "how-strict-is-strict/1", "With $\\delta = 1$ mm and twenty plans a second the hand is off by 3.9 mm",
        EE, (0, 0.3), ("rate_hz=20",), (3.8, 4.0), of=("delta_m=0.001",),
    ),
    # ---------------------------------------- seeing-ahead
    Intervention(
        "seeing-ahead/3", "without the limits on acceleration and its change the hand is off by 18.5 mm",
        EE, (19.8, 20.4), NO_ACCELERATION, (18.3, 18.7),
    ),
    Intervention(
        "seeing-ahead/3", "without the limits on speed by 28 mm",
        EE, (19.8, 20.4), ("limits.velocity=false",), (27.5, 28.4),
    ),
    Intervention("seeing-ahead/3", "without any limits by 37 mm", EE, (19.8, 20.4), NO_LIMITS, (37, 38)),
)
# fmt: on

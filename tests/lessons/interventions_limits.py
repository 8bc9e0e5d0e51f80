"""Interventions for the causes in the lessons on limits, horizon, time, sensors and models, in the order of
the course."""

from __future__ import annotations

from interventions import Intervention, of

HAND = of("error/position", "mm")
Q1 = of("error/q1", "deg")
RADIUS = of("gauge_radius")
X = of("error/position", "mm", "rms", column=0)
NO_FRICTION = ("plant.friction=0", "plant.damping=0")
JOINT_2 = of("q", "deg", column=1)
FORCE = of("contact_force", "N", "last")
AT_THE_END = of("error/position", "mm", "last")
TILT_AT_THE_END = of("error/orientation", "deg", "last")

# fmt: off
LIMIT_ROWS = (
    # ---------------------------------------- torque-has-a-limit
    Intervention(
        "torque-has-a-limit/0", "A bound that is not active has no effect",
        HAND, (0.03, 0.07), ("limits.torque_scale=1",), (0.03, 0.07), stays=True,
    ),
    Intervention(
        "torque-has-a-limit/1",
        "This is due to the order. With joint 1 first the hand has the error, 1.6 mm",
        HAND, (0, 0.1), ("order=q1,position",), (1.55, 1.7),
    ),
    Intervention(
        "torque-has-a-limit/1", "the error of joint 1 does not grow",
        Q1, (0.45, 0.65), ("order=q1,position",), (0, 0.05),
    ),
    Intervention(
        "torque-has-a-limit/1", "the order makes no difference",
        Q1, (2, 3), ("order=q1,position",), (2, 3), of=("q1_amplitude_deg=60",), seconds=1.5, stays=True,
    ),
    Intervention(
        "torque-has-a-limit/2", "with joint 1 first the hand is off as far",
        HAND, (8, 12), ("order=q1,position",), (8, 12), stays=True,
    ),

    Intervention(
        "torque-has-a-limit/0", "this torque is too little for level 1 alone",
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
        "stopping-takes-distance/0", "the rows on speed cause half of it: without them 0.1° is left",
        JOINT_2, (150.05, 150.15), ("limits.torque_scale=1", "plant.saturate=true"), (150.4, 151),
        of=("limits.torque_scale=3", "plant.saturate=false", "limits.velocity=false"),
    ),
    Intervention(
        "stopping-takes-distance/0",
        "With three times the torque, in the bounds and in the motors, 0.2° is left",
        JOINT_2, (150.55, 150.75), ("limits.torque_scale=3", "plant.saturate=false"), (150.15, 150.25),
    ),
    Intervention(
        "stopping-takes-distance/1", "20 ms are enough for an emergency stop",
        JOINT_2, (149.8, 150.0), ("horizon=5",), (150.5, 150.8),
    ),
    Intervention(
        "stopping-takes-distance/2", "The disadvantage is time: the joint moves slowly over the last degrees",
        of("q", "deg", "mean", 1.6, 1.7, column=1), (147.5, 148.7), ("limits.velocity_approach=0",),
        (149.5, 149.7),
    ),
    # ---------------------------------------- a-blind-arm
    Intervention(
        "a-blind-arm/0", "so the controller compensates for this force",
        FORCE, (360, 390), ("controller=osf",), (3, 5),
    ),
    Intervention(
        "a-blind-arm/0", "so MPC is not to blame",
        FORCE, (360, 390), ("controller=tdeosf",), (360, 400), stays=True,
    ),
    Intervention(
        "a-blind-arm/0", "With half of $\\bar M$ the arm presses half as hard",
        FORCE, (360, 390), ("M_bar_scale=0.5",), (180, 205),
    ),
    Intervention(
        "a-blind-arm/1",
        "Stiffness does not limit the force: with half of $K_p$ both bounds are reached, too, up to 0.9 s "
        "later",
        FORCE, (205, 225), ("levels.position.K_p=28.1",), (205, 225), seconds=2.7, stays=True,
    ),
    # ---------------------------------------- keeping-clear
    Intervention(
        "keeping-clear/0", "The position fixes the hand's height, so no freedom is left for the distance",
        FORCE, (280, 300), ("order=distance,position,orientation,posture",), (0, 1),
    ),
    Intervention(
        "keeping-clear/0", "as if there were no task of a distance",
        FORCE, (280, 300), ("levels.distance.enabled=false",), (280, 300), stays=True,
    ),
    Intervention(
        "keeping-clear/1", "A task fixes the whole direction",
        AT_THE_END, (145, 150), ("levels.distance.enabled=false",), (0, 1),
    ),
    Intervention(
        "keeping-clear/2", "the order decides which task has an error",
        TILT_AT_THE_END, (27.5, 28.5), ("order=orientation,position,posture",), (0, 0.5),
    ),
    Intervention(
        "keeping-clear/2", "then the hand stays 6 cm away",
        AT_THE_END, (0, 2), ("order=orientation,position,posture",), (55, 65),
    ),
    Intervention(
        "keeping-clear/3",
        "The lower levels are to blame: with both of them switched off the hand is 5 cm away at that time",
        AT_THE_END, (265, 275), ("levels.orientation.enabled=false", "levels.posture.enabled=false"),
        (45, 58),
    ),
    Intervention(
        "keeping-clear/3", "if only the posture is switched off, 23 cm are left",
        AT_THE_END, (265, 275), ("levels.posture.enabled=false",), (225, 235),
    ),
    # ---------------------------------------- how-far-ahead
    Intervention(
        "how-far-ahead/0", "a longer horizon includes the ends of the joints' ranges sooner",
        X, (0.56, 0.57), ("horizon=15",), (0.538, 0.547), of=("horizon=5",), on="iiwa14-circle-paper",
        seconds=4.0,
    ),
    Intervention(
        "how-far-ahead/0", "a longer horizon includes the ends of the joints' ranges sooner",
        X, (0.47, 0.475), ("horizon=15",), (0.47, 0.475), of=("horizon=5", "limits.position=off"),
        on="iiwa14-circle-paper", seconds=4.0, stays=True,
    ),
    Intervention(
        "how-far-ahead/0", "Twice the $\\bar M$ halves the error; no horizon has this effect.",
        of("error/position", "mm", "rms"), (0.75, 1.0), ("M_bar_scale=2",), (0.3, 0.55),
    ),
    Intervention(
        "how-far-ahead/1", "so no step removes all of $e$",
        of("error/position", "mm", "rms"), (0.75, 1.1), ("R_on=acceleration",), (1.2, 9),
        of=("R_on=torque", "horizon=1"),
    ),
    # ---------------------------------------- deadlines
    Intervention(
        "deadlines/0", "every torque is one tick late", HAND, (3, 4), ("deadline_ms=0",), (1.2, 1.7),
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
        "deadlines/2", "The effect of noise doubles",
        of("delta_tau", "N·m", "rms"), (1.1, 1.6), ("M_bar_scale=1",), (0.5, 0.8),
        of=("plant.encoder_resolution_deg=0.001",), seconds=0.3,
    ),
    # ---------------------------------------- sensors-are-coarse
    Intervention(
        "sensors-are-coarse/0", "With finer encoders the noise decreases in proportion.",
        of("delta_tau", "N·m", "rms"), (3.2, 4.4), ("plant.encoder_resolution_deg=0.0025",), (1.6, 2.2),
    ),
    Intervention(
        "sensors-are-coarse/1", "half of $\\bar M$ leaves half of the noise",
        of("delta_tau", "N·m", "rms"), (3.2, 4.4), ("M_bar_scale=0.5",), (1.6, 2.2), of=("T_s=0.001",),
    ),
    Intervention(
        "sensors-are-coarse/1", "again the error grows by little more than half",
        HAND, (0.088, 0.102), ("M_bar_scale=0.5",), (0.138, 0.165), of=("T_s=0.001",),
    ),
    Intervention(
        "sensors-are-coarse/0", "then the noise alone takes all the torque",
        HAND, (20, 200), ("limits.torque_scale=10", "plant.saturate=false"), (0, 0.5),
        of=("plant.encoder_resolution_deg=0.02",),
    ),
    Intervention(
        "sensors-are-coarse/1", "ten times the period is too slow for the circle",
        HAND, (0.5, 0.7), ("plant.encoder_resolution_deg=0",), (0.5, 0.7), of=("T_s=0.01",), stays=True,
    ),
    Intervention(
        "sensors-are-coarse/1", "OSF's torque is smoother, but its model has no friction",
        HAND, (1, 1.4), NO_FRICTION, (0, 0.3), of=("controller=osf",),
    ),
    # ---------------------------------------- the-model-is-wrong
    Intervention(
        "the-model-is-wrong/0", "whereas time-delay estimation measures them afterwards",
        HAND, (0.009, 0.014), ("T_s=0.0005",), (0.004, 0.007), of=("controller=himpc",),
    ),
    Intervention(
        "the-model-is-wrong/1", "here these are mostly friction",
        HAND, (0.7, 1.6), ("plant.friction=0",), (0, 0.3), seconds=0.75,
    ),
    Intervention(
        "the-model-is-wrong/1", "here these are mostly friction",
        HAND, (0.7, 1.6),
        ("nominal.mass_scale=1", "nominal.inertia_scale=1", "nominal.armature=[0.05,0.05,0.03]"), (0.7, 1.6),
        seconds=0.75, stays=True,
    ),
    Intervention(
        "the-model-is-wrong/2", "Heavier links make $M^{-1}\\bar M$ smaller, so corrections are slower",
        HAND, (0.047, 0.06), ("M_bar_scale=1.3",), (0.03, 0.044),
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
        "the inertia of the motors is left: with links of a twentieth of the mass the gauge reads 0.47",
        RADIUS, (0.465, 0.475), ("plant.armature=0.01",), (1.2, 4),
        of=("plant.mass_scale=0.05", "plant.inertia_scale=0.05"), seconds=0.05,
    ),
    Intervention(
        "the-model-is-wrong/2", "with links of this weight the loop is unstable with such a large M̄",
        RADIUS, (1.5, 4), ("plant.mass_scale=10", "plant.inertia_scale=10"), (0.5, 0.98),
        of=("M_bar_scale=4",), seconds=0.05,
    ),
    Intervention(
        "the-model-is-wrong/2", "HQP's model has no friction",
        HAND, (0.9, 1.6), NO_FRICTION, (0, 0.3), of=("controller=hqp",), seconds=0.6,
    ),
    Intervention(
        "further/the-model-is-wrong", "That is why most of OSF's error in *As identified* is due to friction",
        HAND, (0.7, 1.6), ("plant.friction=0",), (0, 0.3), on="the-model-is-wrong/1", seconds=0.75,
    ),
    # ---------------------------------------- inside-the-qp
    Intervention(
        "inside-the-qp/3", "Time-delay estimation measures the leak at the next tick and corrects it",
        of("error/reach", "mm", "rms", 0.5), (0, 0.6), ("controller=hqp",), (1.2, 3), seconds=0.9,
    ),
    Intervention(
        "inside-the-qp/3", "over tens of ticks",
        of("gauge_radius", "", "mean"), (0.9, 0.92), ("M_bar_scale=2",), (0.82, 0.84),
    ),
)
# fmt: on

"""Interventions for the sentences that replaced those which an independent reader had refuted by an
experiment."""

from __future__ import annotations

from interventions import Intervention, of

HAND, HAND_RMS = of("error/position", "mm"), of("error/position", "mm", "rms")
HAND_LAST = of("error/position", "mm", "last")
X = of("error/position", "mm", "rms", column=0)
ROUGH = of("delta_tau", "N·m", "rms")
JOINT_2 = of("q", "deg", column=1)
TORQUE = of("torque share", "%")
SWING = of("v", "deg/s", "largest", 2.0, column=2)
LATE_SWING = of("v", "deg/s", "largest", 3.5, column=2)
EE = of("error/ee", "mm")
NO_FRICTION = ("plant.friction=0", "plant.damping=0")
OLD_LINKS = ("plant.mass_scale=1", "plant.inertia_scale=1")
LONG = ("horizon=5", "horizon=30")
STEP = of("step/base", "", "mean")
INF = float("inf")

# fmt: off
READER_ROWS = (
    # ---------------------------------------- one-task
    Intervention(
        "one-task/3",
        "the part of the torques along the free motion stays as it is, and this part reverses joint 2",
        of("v", "deg/s", "mean", 0.495, 0.505, column=1), (78, 82), ("damping=true",), (-10, 10),
        seconds=0.6,
    ),
    # ---------------------------------------- your-robot
    Intervention(
        "your-robot/0", "in a sum the orientation and the posture hold the head back",
        HAND_LAST, (75, 85), ("levels.orientation.enabled=false",), (0, 1),
        of=("controller=weighted", "levels.posture.enabled=false"),
    ),
    Intervention(
        "your-robot/0", "even one of the two alone",
        HAND_LAST, (90, 105), ("levels.posture.enabled=false",), (0, 1),
        of=("controller=weighted", "levels.orientation.enabled=false"),
    ),

    # ---------------------------------------- inside-the-qp
    Intervention(
        "inside-the-qp/0", "With equal weights the error is 12 degrees",
        of("error/pose", "deg", "last"), (14, 14.5), ("levels.pose.Q=200",), (11.7, 12.1),
    ),
    # ---------------------------------------- two-tasks
    Intervention(
        "two-tasks/2", "With level 2 joint 3 swings with up to 100°/s",
        of("v", "deg/s", "largest", column=2), (99, 101), ("levels.q1.enabled=false",), (20, 30),
    ),
    Intervention(
        "two-tasks/2", "time-delay estimation has to correct the effects of that motion",
        HAND, (0.7, 1.0), ("limits.velocity_scale=0.5",), (0.4, 0.5),
    ),
    # ---------------------------------------- when-tasks-fight
    Intervention(
        "when-tasks-fight/2", "with $N = 1$ and $R_2 = 10^5$ joint 3 continues to swing with 62°/s",
        LATE_SWING, (61.5, 62.5), ("levels.q1.R=10",), (11, 12.5), of=("horizon=1", "levels.q1.R=1e5"),
    ),
    Intervention(
        "when-tasks-fight/1", "The inverse demands more than the arm can do and contains no bound",
        of("speed share", "%"), (2000, INF), ("controller=tdeosf_damped",), (0, 500),
    ),
    Intervention(
        "when-tasks-fight/1", "A controller without any inverse loses control as well if nothing bounds it",
        of("v", "deg/s"), (2000, INF),
        ("limits.torque_scale=1", "plant.saturate=true", "limits.velocity=true", "limits.position=viability"),
        (50, 150),
        of=("controller=himpc", "limits.torque_scale=1000", "plant.saturate=false", "limits.velocity=false",
            "limits.position=off"),
    ),
    Intervention(
        "when-tasks-fight/2",
        "in a weighted sum with $Q_2 = 0.01$ joint 3 swings as well, with up to 73°/s",
        SWING, (72, 73.4), ("q1_amplitude_deg=20",), (0, 50), of=("controller=weighted", "levels.q1.Q=0.01"),
    ),
    Intervention(
        "when-tasks-fight/2", "With $R_2 = 10^5$ the swing slows down to 58°/s",
        SWING, (93, 95), ("levels.q1.R=1e5",), (57, 58.4),
    ),
    # ---------------------------------------- stretched-out
    Intervention(
        "stretched-out/0", "Then, at 0.13 s, the demand exceeds a thousand times the limit",
        of("torque share", "%", "largest", 0.12, 0.14), (1e5, INF), ("controller=osf_damped",), (0, 5),
        of=("smooth=true",),
    ),
    # ---------------------------------------- torque-has-a-limit
    Intervention(
        "torque-has-a-limit/0", "without any friction the same motion needs a third of the 0.24 N·m",
        TORQUE, (85, 92), NO_FRICTION, (32, 36),
    ),
    Intervention(
        "torque-has-a-limit/0", "with viscous friction only it needs half of the 0.24 N·m",
        TORQUE, (85, 92), ("plant.friction=0",), (48, 54),
    ),
    Intervention(
        "torque-has-a-limit/0",
        "this torque is too little for level 1 alone, with the dry friction of the joints",
        HAND, (0.5, 30), ("plant.friction=0",), (0, 0.1), of=("limits.torque_scale=0.03",),
    ),
    Intervention(
        "torque-has-a-limit/1", "The torque is scarce because of friction, dry and viscous together",
        of("error/q1", "deg"), (0.45, 0.65), ("plant.friction=0",), (0, 0.05),
    ),
    Intervention(
        "torque-has-a-limit/1", "without dry friction both tasks together need 77 % of the available torque",
        TORQUE, (99, 101), ("plant.friction=0",), (76, 77.4),
    ),
    Intervention(
        "torque-has-a-limit/2", "Without dry friction the circle by itself would need 0.07 N·m",
        TORQUE, (99, 101), ("plant.friction=0",), (55, 62),  # of 0.12 N·m
        of=("levels.q1.enabled=false",),
    ),
    Intervention(
        "torque-has-a-limit/2", "and the hand would stay on it", HAND, (8, 12), ("plant.friction=0",),
        (0, 0.1),
    ),
    # ---------------------------------------- stopping-takes-distance
    Intervention(
        "stopping-takes-distance/0",
        "The rows on speed add 0.07° to the overrun: without them the overrun is still 0.57°",
        JOINT_2, (150.635, 150.65), ("limits.velocity=false",), (150.565, 150.58),
    ),
    # ---------------------------------------- how-far-ahead
    Intervention(
        "how-far-ahead/0", "Over the 4 s the error in x is smaller with $N = 1$ than with $N = 30$",
        X, (0.528, 0.538), ("horizon=1",), (0.47, 0.476), of=LONG, on="iiwa14-circle-paper", seconds=4.0,
    ),
    Intervention(
        "how-far-ahead/0", "1600 QPs have no solution with $N = 1$",
        of("unsolved", "", "sum"), (0, 50), ("horizon=1",), (1550, 1700), of=LONG, on="iiwa14-circle-paper",
        seconds=4.0,
    ),
    Intervention(
        "how-far-ahead/1", "its cost counts once and its effect counts at twenty knots, so $R$ weighs less",
        HAND_RMS, (1.35, 1.6), ("horizon=1",), (2.4, 3.0),
    ),
    Intervention(
        "how-far-ahead/1", "At $R = 0.1$ the errors of the two horizons are equal",
        HAND_RMS, (0.93, 1.07), ("horizon=1",), (0.93, 1.07), of=("R=0.1",), stays=True,
    ),
    Intervention(
        "how-far-ahead/1", "one step ahead has a smaller error than twenty steps with $R = 10$",
        HAND_RMS, (1.35, 1.6), ("horizon=1", "R=0.1"), (0.93, 1.07),
    ),
    Intervention(
        "how-far-ahead/1", "and its torque is as smooth",
        ROUGH, (0.064, 0.071), ("horizon=1", "R=0.1"), (0.064, 0.071), stays=True,
    ),
    # ---------------------------------------- the-model-is-wrong
    Intervention(
        "the-model-is-wrong/2",
        "The part of the error that is due to inertia grows by half, as the mass does",
        HAND, (0.0158, 0.0172), OLD_LINKS, (0.0105, 0.0114), of=NO_FRICTION,
    ),
    Intervention(
        "the-model-is-wrong/2",
        "three quarters of the error are due to friction, which does not grow with the mass",
        HAND, (0.041, 0.047), NO_FRICTION, (0.0105, 0.0114), of=OLD_LINKS,
    ),
    # ---------------------------------------- seeing-ahead
    Intervention(
        "seeing-ahead/1", "On its way home the base drives at its top speed along both axes",
        of("v", column=0), (1.095, 1.105), ("limits.velocity_scale=0.5",), (0.54, 0.56),
    ),
    Intervention(
        "seeing-ahead/1", "On its way home the base drives at its top speed along both axes",
        of("v", column=1), (1.095, 1.105), ("limits.velocity_scale=0.5",), (0.54, 0.56),
    ),
    Intervention(
        "seeing-ahead/2", "With $Q = 1$ and the scene's own limits the planner is still 22 cm away",
        of("error/base", "m", "mean", 10.0, 10.2), (0, 0.05), ("Q=1",), (0.215, 0.23),
        of=("controller=htmpc_wpt",),
    ),
    Intervention(
        "seeing-ahead/3", "the faster base and arm move, the further the hand drifts",
        EE, (15, 25), ("limits.velocity_scale=0.5",), (6, 9),
    ),
    Intervention(
        "seeing-ahead/3", "It drifts most at the edge of the arm's reach, 20 mm,",
        EE, (19.9, 20.2), ("peak=[0.3,-0.5]",), (3.7, 4.3),
    ),
    Intervention(
        "seeing-ahead/3", "with a near peak by 4 mm", EE, (19, 21), ("peak=[0.3,-0.5]",), (3.7, 4.3),
    ),
    Intervention(
        "seeing-ahead/3", "With a peak that the arm can just reach the hand is off by 14 mm",
        EE, (19, 21), ("peak=[0.55,-1.35]",), (13.7, 14.4),
    ),
    Intervention(
        "seeing-ahead/3", "on the way home, 16 mm, where the base is at full speed",
        of("error/ee", "mm", "largest", 5.0), (15.8, 16.4), ("limits.velocity_scale=0.5",), (5, 8),
    ),
    # ---------------------------------------- documents
    Intervention(
        "disagreements", "with 0.4 N·m at every joint it grows by about a half",
        of("error/position", "mm", "rms", 1.0), (0.33, 0.38), ("plant.friction=0.4",), (0.5, 0.6),
        on="planar3-conflict", seconds=4.0,
    ),
    Intervention(
        "disagreements", "our error of x is larger with N = 30 than with N = 1",
        X, (0.528, 0.538), ("horizon=1",), (0.47, 0.476), of=LONG, on="iiwa14-circle-paper", seconds=4.0,
    ),
)
# fmt: on

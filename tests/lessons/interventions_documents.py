"""Interventions for the causes that the glossary, the page of disagreements and the results name."""

from __future__ import annotations

from functools import partial

from interventions import Intervention, of

HAND_RMS = of("error/position", "mm", "rms", 1.0)
RT2 = partial(Intervention, on="planar3-conflict", seconds=3.0)
RT1 = partial(Intervention, on="planar3-circle", seconds=2.0)
RT4 = partial(Intervention, on="iiwa14-circle-paper", seconds=2.0)
STRICT = partial(Intervention, on="how-strict-is-strict/2")
SQUARE = partial(Intervention, on="ridgeback-ur10-square", seconds=12.0)
X = of("error/position", "mm", "rms", column=0)
O_Z = of("error/orientation", "deg", "rms")
ROUGH = of("delta_tau", "N·m", "rms", 1.0)
ENCODER = "plant.encoder_resolution_deg=0.00125"
CHATTER = ("plant.encoder_resolution_deg=0.005", "limits.position=off")
DIAGONAL = "plant.diagonal_scale=[0.8,0.8,1.2,1.2,0.8,1.2,1.2]"
INF = float("inf")
FIVE = ("M_bar=[0.1,0.21,0.033,0.042,0.005,0.005,0.0015]",)
LIGHT = ("plant.mass_scale=[1,1,1,1,0.3,0.3,0.3]", "plant.inertia_scale=[1,1,1,1,0.2,0.2,0.2]")

# fmt: off
DOCUMENT_ROWS = (
    # ---------------------------------------- glossary
    Intervention(
        "glossary", "If the result is computed with the true inertia, lower levels change it a little.",
        of("dynamic_leak", "m/s²"), (1e-3, 1e3), ("controller=osf", "nominal.armature=[0.05,0.05,0.03]"),
        (0, 1e-4),
        on="inside-the-qp/3",
    ),
    # ---------------------------------------- a conflict reaches level 1
    RT2(
        "disagreements", "Twice the M̄ halves the error of level 1", HAND_RMS, (0.25, 0.5), ("M_bar_scale=2",),
        (0.1, 0.24),
    ),
    RT2(
        "disagreements", "half the period nearly halves it",
        HAND_RMS, (0.25, 0.5), ("T_s=0.0005",), (0.1, 0.24),
    ),
    RT2(
        "disagreements", "Half the velocity limit halves it",
        HAND_RMS, (0.25, 0.5), ("limits.velocity_scale=0.5",), (0.1, 0.24),
    ),
    RT2(
        "disagreements",
        "without this limit joint 3 moves faster and the error of level 1 is three times as large",
        HAND_RMS, (0.25, 0.5), ("limits.velocity=false",), (0.8, 1.6),
    ),
    RT2(
        "disagreements", "without this limit joint 3 moves faster",
        of("v", "deg/s", "largest", 2.0, column=2), (80, 100), ("limits.velocity=false",), (130, 250),
    ),
    RT2(
        "disagreements", "Our friction is not the cause: without it the error of level 1 is the same.",
        HAND_RMS, (0.25, 0.5), ("plant.friction=0", "plant.damping=0"), (0.25, 0.5), stays=True,
    ),
    Intervention(
        "disagreements", "with N = 1 it dies away, and three quarters of the error remain",
        HAND_RMS, (0.35, 0.365), ("horizon=1",), (0.26, 0.29), on="planar3-conflict",
    ),
    RT2(
        "disagreements", "RT1 has no such oscillation.", HAND_RMS, (0.25, 0.5), ("q1_amplitude_deg=20",),
        (0, 0.06),
    ),
    # ---------------------------------------- RT4
    RT4(
        "disagreements", "a lighter wrist in the authors' model would explain a part",
        of("error/orientation", "deg", "rms", column=2), (0.8, 1.4), LIGHT, (0.15, 0.35),
    ),
    RT4(
        "disagreements", "with five times our M̄ of joints 5 to 7 the three errors fall",
        of("error/orientation", "deg", "rms", column=2), (0.8, 1.4), FIVE, (0.15, 0.35),
    ),
    RT4(
        "disagreements",
        "our errors are those of time-delay estimation and are roughly proportional to T_s·M/M̄",
        of("error/position", "mm", "rms"), (0.55, 0.85), ("M_bar_scale=2",), (0.25, 0.43),
    ),
    # ---------------------------------------- RT1
    RT1(
        "disagreements", "with 0.4 N·m of dry friction at every joint",
        HAND_RMS, (0.11, 0.16), ("plant.friction=[0.1,0.08,0.05]",), (0.01, 0.04),
        of=("plant.friction=0.4",),
    ),
    RT1(
        "disagreements", "Without dry friction our errors are less than a third of those with our friction",
        HAND_RMS, (0.02, 0.045), ("plant.friction=0",), (0.003, 0.0125), seconds=4.0,
    ),
    RT1(
        "disagreements", "A third of M̄ has the same effect",
        HAND_RMS, (0.055, 0.1), ("M_bar_scale=1",), (0.01, 0.04), of=("M_bar_scale=0.3",),
    ),
    RT1(
        "disagreements", "most of OSF's error is due to friction",
        HAND_RMS, (1.0, 1.7), ("plant.friction=0", "plant.damping=0"), (0, 0.3), of=("controller=osf",),
    ),
    # ---------------------------------------- a disturbed inertia
    RT4(
        "disagreements",
        "If M̄ is altered by the same factors as diag M(q), most of the change in orientation disappears",
        O_Z, (1.0, 1.2), ("M_bar=[0.08,0.168,0.0396,0.0504,0.0008,0.0012,0.00036]",), (1.35, 1.55),
        of=(DIAGONAL,), seconds=1.0,
    ),
    RT4(
        "disagreements", "HIMPC's errors are the same with a nominal inertia that is a fifth larger",
        X, (0.535, 0.545), ("nominal.mass_scale=1.2", "nominal.inertia_scale=1.2"), (0.535, 0.545),
        stays=True,
    ),
    RT4(
        "disagreements", "hardly change if only the inertia of link 3 is disturbed",
        X, (0.535, 0.545), ("plant.inertia_scale=[1,1,1.2,1,1,1,1]",), (0.535, 0.545), stays=True,
    ),
    # ---------------------------------------- horizon
    RT4(
        "disagreements", "Our error decreases only where joints meet their position limits",
        X, (0.47, 0.475), ("horizon=15",), (0.47, 0.475), of=("horizon=5", "limits.position=off"),
        seconds=4.0, stays=True,
    ),
    RT4(
        "disagreements", "The first increment already removes nearly all of e",
        X, (1.2, 1.6), ("horizon=20",), (0.6, 0.8),
        of=("R_on=acceleration", "limits.position=viability", "horizon=1"), seconds=1.2,
    ),
    RT4(
        "disagreements", "The first increment already removes nearly all of e",
        X, (0.65, 0.72), ("horizon=20",), (0.65, 0.72), of=("horizon=1",), seconds=1.2, stays=True,
    ),
    # ---------------------------------------- TDEOSF and HIMPC
    RT1(
        "disagreements", "such a controller is TDEOSF",
        HAND_RMS, (0.005, 0.015), ("controller=tdeosf",), (0.005, 0.015), seconds=1.5, stays=True,
    ),
    RT1(
        "disagreements", "With the printed weights a tick of HIMPC leaves",
        HAND_RMS, (0.02, 0.05), ("R=1e5",), (0.055, 0.1), seconds=2.25,
    ),
    # ---------------------------------------- smoothness, chatter
    RT1(
        "disagreements", "Controllers that remove nearly all of e in a tick react to noise in the same way",
        ROUGH, (0.85, 1.05), ("R_on=acceleration", "horizon=1"), (0.6, 0.8), of=(ENCODER,), seconds=1.5,
    ),
    RT1(
        "disagreements", "Controllers that remove nearly all of e in a tick react to noise in the same way",
        ROUGH, (0.85, 1.05), ("controller=tdeosf",), (0.85, 1.05), of=(ENCODER,), seconds=1.5, stays=True,
    ),
    *(
        RT4(
            "disagreements", "S is proportional to M̄ δ/T_s²",
            of("delta_tau", "N·m", "rms"), (13, 17), (without,), gone, of=CHATTER, seconds=1.0,
        )
        for without, gone in (
            ("M_bar_scale=0.5", (6.5, 8.5)),
            ("plant.encoder_resolution_deg=0.0025", (6.5, 8.5)),
            ("T_s=0.002", (3.2, 4.3)),
        )
    ),
    # ---------------------------------------- RT3
    *(
        Intervention(
            at, says, of("torque share", "%"), (1e6, INF), ("controller=hqp",), (0, 20),
            of=("controller=osf",), on="planar3-singular", seconds=0.15,
        )
        for at, says in (
            ("disagreements", "ours tracks accelerations and inverts nothing, so no inversion can fail"),
            ("results", "ours never inverts J M⁻¹Jᵀ"),
        )
    ),
    # ---------------------------------------- limits
    *(
        Intervention(
            "house", "Time-delay estimation needs tens of ticks to stop an acceleration",
            of("speed share", "%"), there, without, gone, of=("limits.velocity_approach=0",),
            on="iiwa14-circle", seconds=1.0,
        )
        for there, without, gone in (
            ((116.5, 117.5), ("limits.velocity_approach=15",), (99, 100.5)),
            ((116.5, 117.5), ("M_bar_scale=2",), (104, 107)),
        )
    ),
    Intervention(
        "results", "with the data sheet's velocity limits (`iiwa14-circle`) joint 1 cannot swing as asked",
        of("error/q1", "deg"), (80, 100), ("limits.velocity=false",), (0, 30), on="iiwa14-circle",
        seconds=2.0,
    ),
    Intervention(
        "results", "Dry friction of 5 N·m at every joint costs 1.8 mm",
        of("error/position", "mm", "rms", 1.0), (2.05, 2.25), ("plant.friction=0",), (0.2, 0.3),
        of=("M_bar_adapt=true", "plant.payload_kg=2", "plant.friction=5"), on="iiwa14-circle", seconds=2.25,
    ),
    # ---------------------------------------- formulation C
    SQUARE(
        "disagreements", "upper levels pay for deviations from their shifted previous plan, not for effort",
        of("error/ee", "mm", "mean"), (0, 0.1), ("formulation=paper",), (8, 15),
    ),
    SQUARE(
        "disagreements",
        "if the weight of speed is a thousandth as large, the hand's error is less than half as large",
        of("error/ee", "mm", "mean"), (8, 15), ("velocity_effort=0.001",), (3, 5), of=("formulation=paper",),
    ),
    SQUARE(
        "disagreements", "C is not the paper's formulation: in A the base comes home later",
        of("error/base", "m", "mean", 8.0), (0.1, 0.16), ("formulation=paper",), (0.4, 0.65),
    ),
    # ---------------------------------------- formulation A
    STRICT(
        "disagreements", "With Q = 100 in place of our 1 the order is the printed one",
        of("error/ee", "mm", "mean"), (8, 30), ("Q=100",), (1.2, 3.2),
        of=("formulation=paper", "lexicographic=per_coordinate"),
    ),
    STRICT(
        "disagreements", "the hand's error with (12) is then about half of that with (11)",
        of("error/ee", "mm", "mean"), (1.2, 2.8), ("lexicographic=cost",), (3.0, 5.0),
        of=("formulation=paper", "lexicographic=per_coordinate", "Q=100"),
    ),
    STRICT(
        "how-strict-is-strict/2", "With our $Q = 1$ the error of the hand is larger under (12)",
        of("error/ee", "mm", "mean"), (8, 30), ("lexicographic=cost",), (3.0, 6.0),
        of=("formulation=paper", "lexicographic=per_coordinate"),
    ),
    STRICT(
        "how-strict-is-strict/2", "With $Q = 100$ the mean error of the hand is smaller under (12)",
        of("error/ee", "mm", "mean"), (1.2, 2.8), ("lexicographic=cost",), (3.0, 5.0),
        of=("formulation=paper", "lexicographic=per_coordinate", "Q=100"),
    ),
    STRICT(
        "how-strict-is-strict/2", "largest error is still larger",
        of("error/ee", "mm"), (9.5, 11), ("lexicographic=cost",), (7, 8),
        of=("formulation=paper", "lexicographic=per_coordinate", "Q=100"),
    ),
    STRICT(
        "further/how-strict-is-strict", "and better with $Q = 100$",
        of("error/ee", "mm", "mean"), (1.2, 2.8), ("lexicographic=cost",), (3.0, 5.0),
        of=("formulation=paper", "lexicographic=per_coordinate", "Q=100"),
    ),
)
# fmt: on

"""What the glossary, the page of disagreements and the results say of causes."""

from __future__ import annotations

from functools import partial

from interventions import Intervention, of

HAND_RMS = of("error/position", "mm", "rms", 1.0)
RT2 = partial(Intervention, on="planar3-conflict", seconds=4.0)
RT1 = partial(Intervention, on="planar3-circle", seconds=8.0)
RT4 = partial(Intervention, on="iiwa14-circle-paper", seconds=2.0)
STRICT = partial(Intervention, on="how-strict-is-strict/2")
FIVE = ("M_bar=[0.1,0.21,0.033,0.042,0.005,0.005,0.0015]",)
LIGHT = ("plant.mass_scale=[1,1,1,1,0.3,0.3,0.3]", "plant.inertia_scale=[1,1,1,1,0.2,0.2,0.2]")

# fmt: off
DOCUMENT_ROWS = (
    # ---------------------------------------- glossary
    Intervention(
        "glossary", "what the true inertia makes of it is the leak",
        of("dynamic_leak", "m/s²"), (1e-3, 1e3), ("controller=osf", "nominal.armature=[0.05,0.05,0.03]"),
        (0, 1e-4),
        on="inside-the-qp/3",
    ),
    # ---------------------------------------- a conflict reaches level 1
    RT2(
        "disagreements", "Twice the M̄ halves level 1's error", HAND_RMS, (0.25, 0.5), ("M_bar_scale=2",),
        (0.1, 0.24),
    ),
    RT2(
        "disagreements", "half the period nearly does", HAND_RMS, (0.25, 0.5), ("T_s=0.0005",), (0.1, 0.24),
    ),
    RT2(
        "disagreements", "half the bound on speed halves it",
        HAND_RMS, (0.25, 0.5), ("limits.velocity_scale=0.5",), (0.1, 0.24),
    ),
    RT2(
        "disagreements", "without that bound joint 3 swings faster and level 1 errs three times as much",
        HAND_RMS, (0.25, 0.5), ("limits.velocity=false",), (0.8, 1.6),
    ),
    RT2(
        "disagreements", "without that bound joint 3 swings faster",
        of("v", "deg/s", "largest", 2.0, column=2), (80, 100), ("limits.velocity=false",), (130, 250),
    ),
    RT2(
        "disagreements", "Friction makes no difference.",
        HAND_RMS, (0.25, 0.5), ("plant.friction=0", "plant.damping=0"), (0.25, 0.5), stays=True,
    ),
    RT2(
        "disagreements", "RT1 has no such swing.", HAND_RMS, (0.25, 0.5), ("q1_amplitude_deg=20",),
        (0, 0.06),
    ),
    # ---------------------------------------- RT4
    RT4(
        "disagreements", "a lighter wrist in the authors' model would do part of it",
        of("error/orientation", "deg", "rms", column=2), (0.8, 1.4), LIGHT, (0.15, 0.35),
    ),
    RT4(
        "disagreements", "five times our M̄ of joints 5 to 7 leaves similar shares",
        of("error/orientation", "deg", "rms", column=2), (0.8, 1.4), FIVE, (0.15, 0.35),
    ),
    RT4(
        "disagreements", "our errors are those of time-delay estimation and go with T_s·M/M̄",
        of("error/position", "mm", "rms"), (0.55, 0.85), ("M_bar_scale=2",), (0.25, 0.43),
    ),
    # ---------------------------------------- RT1
    RT1(
        "disagreements", "with 0.4 N·m of dry friction at every joint",
        HAND_RMS, (0.11, 0.16), ("plant.friction=[0.1,0.08,0.05]",), (0.02, 0.045),
        of=("plant.friction=0.4",),
    ),
    RT1(
        "disagreements", "with none ours are less than a third of what they are",
        HAND_RMS, (0.02, 0.045), ("plant.friction=0",), (0.003, 0.0125),
    ),
    RT1(
        "disagreements", "A third of M̄ does the same",
        HAND_RMS, (0.07, 0.15), ("M_bar_scale=1",), (0.02, 0.05), of=("M_bar_scale=0.3",),
    ),
    RT1(
        "disagreements", "most of its error is friction's",
        HAND_RMS, (2.2, 3.6), ("plant.friction=0", "plant.damping=0"), (0, 1.0), of=("controller=osf",),
    ),
    # ---------------------------------------- formulation A
    STRICT(
        "disagreements", "With Q = 100 in place of our 1 the order is the printed one",
        of("error/ee", "mm", "mean"), (8, 30), ("Q=100",), (1.2, 3.2),
        of=("formulation=paper", "lexicographic=per_coordinate"),
    ),
    STRICT(
        "disagreements", "the hand then errs about half as much with (12) as with (11)",
        of("error/ee", "mm", "mean"), (1.2, 2.8), ("lexicographic=cost",), (3.0, 5.0),
        of=("formulation=paper", "lexicographic=per_coordinate", "Q=100"),
    ),
    STRICT(
        "how-strict-is-strict/2", "with our $Q = 1$ the hand is worse off under (12)",
        of("error/ee", "mm", "mean"), (8, 30), ("lexicographic=cost",), (3.0, 6.0),
        of=("formulation=paper", "lexicographic=per_coordinate"),
    ),
    STRICT(
        "how-strict-is-strict/2", "with $Q = 100$ better",
        of("error/ee", "mm", "mean"), (1.2, 2.8), ("lexicographic=cost",), (3.0, 5.0),
        of=("formulation=paper", "lexicographic=per_coordinate", "Q=100"),
    ),
    STRICT(
        "further/how-strict-is-strict", "with 100 better",
        of("error/ee", "mm", "mean"), (1.2, 2.8), ("lexicographic=cost",), (3.0, 5.0),
        of=("formulation=paper", "lexicographic=per_coordinate", "Q=100"),
    ),
)
# fmt: on

"""Interventions for the sentences that replaced those which a fifth independent reader had refuted or found
half true."""

from __future__ import annotations

from functools import partial

from interventions import Intervention, of

HAND, EE = of("error/position", "mm"), of("error/ee", "mm")
STEP = of("step/base", "", "mean")
PLANS = partial(Intervention, "how-strict-is-strict/1", measure=EE)
STEPS = partial(Intervention, "how-strict-is-strict/2", measure=STEP, there=(0.02, 0.025))
EVERY_FIFTH, EVERY_TWENTIETH = ("dt=0.2", "horizon=5"), ("dt=0.05", "horizon=20")
QUICKER = ("tasks.position.K_p=800", "tasks.position.K_v=20")
INF = float("inf")

# fmt: off
FIFTH_ROWS = (
    Intervention(
        "two-tasks/2", "with $Q_2 = 0.01$ the hand is off by 1.8 mm",
        HAND, (0.5, 1.2), ("levels.q1.Q=0.01",), (1.7, 1.85),
    ),
    Intervention(
        "two-tasks/2", "The weight changes that motion, too",
        of("v", "deg/s", "rms", 2.0, column=2), (64, 67), ("levels.q1.Q=0.01",), (31, 33),
    ),
    *(
        Intervention("stretched-out/2", says, HAND, (4.3, 4.8), QUICKER, (1.6, 1.8), of=("smooth=false",))
        for says in ("mostly due to the desired motion", "twice the $K_V$ the error after the jump is 1.7 mm")
    ),
    Intervention(
        "when-tasks-fight/0", "without bounds it demands a hundred times the limit, too",
        of("tau_demand", "N·m"), (0, 4.01),
        ("limits.torque=false", "limits.velocity=false", "limits.position=off"), (400, INF),
        of=("controller=himpc",),
    ),
    Intervention(
        "torque-has-a-limit/1", "without any friction joint 1 does not fall behind",
        of("error/q1", "deg"), (0.45, 0.65), ("plant.damping=0",), (0, 0.05),
    ),
    Intervention(
        "stopping-takes-distance/0",
        "because the rows on the position contradict the rows on the change of speed",
        of("unsolved", "", "sum"), (100, 150), ("limits.velocity_approach=0",), (6.5, 7.5),
        of=("limits.velocity_scale=0.15",), seconds=5.0,
    ),
    PLANS(
        says="0.9 mm with five plans a second and a knot every 0.2 s ($N = 5$); 9 mm with ten",
        there=(0.85, 0.95), without=("rate_hz=10",), gone=(8.5, 9.5), of=(*EVERY_FIFTH, "rate_hz=5"),
    ),
    PLANS(
        says="0.6 mm with twenty plans a second and a knot every 0.05 s ($N = 20$); 2.8 mm with ten",
        there=(0.55, 0.65), without=("rate_hz=10",), gone=(2.7, 2.85), of=(*EVERY_TWENTIETH, "rate_hz=20"),
    ),
    STEPS(
        says="If the cost of level 1 contains effort, with the same $Q = 10$ (`formulation=paper` and `Q=10`)"
        ", its best plan leaves an error and the cost has a slope, but the steps are as short as before. So "
        "the missing slope is not the reason.",
        without=("formulation=paper", "Q=10"), gone=(0.02, 0.025), stays=True,
    ),
    STEPS(says="with $Q = 1$ they are 2.3 times as long", without=("Q=1",), gone=(0.049, 0.054)),
    Intervention(
        "how-strict-is-strict/2", "still far shorter than with (12)",
        STEP, (0.049, 0.054), ("lexicographic=per_coordinate",), (0.9, 1.0), of=("Q=1",),
    ),
)
# fmt: on

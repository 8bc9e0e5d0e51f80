"""What one control tick decided, with its evidence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import LevelSolution
from himpc.limits import LimitsInForce, Rows

Array = NDArray[np.float64]


class Binding(NamedTuple):
    """A constraint that binds: who feels it, which joint, which bound, and how hard."""

    level: str
    joint: str
    kind: str
    side: str
    knot: int
    multiplier: float
    slack: float


class Plan(NamedTuple):
    """The first input, the prediction, and per level what was found.

    Attributes:
        tau: torque to apply now, (n,) N·m: τ₀ + Δτ*_{r,k|k}, inside the torque bounds; what controllers
            that know no bounds (OSF, TDEOSF) demand.
        tau_0: torque that was applied last, (n,) N·m.
        levels: one solution per active level, highest priority first.
        q: predicted positions at knots 0 … N, (N+1, n).
        errors: x̃ per task name, (m,) each.
        values: x per task name.
        rows: the bounds the last level was solved under.
        limits: the bounds in force.
        step_us: wall time from state to torque, microseconds, kinematics included.
        unsolved: how many QPs had no verified point at the first attempt.
        iterations: how many times the cascade was solved; 1 but for NHIMPC.
    """

    tau: Array
    tau_0: Array
    levels: tuple[LevelSolution, ...]
    q: Array
    errors: dict[str, Array]
    values: dict[str, Array]
    rows: Rows
    limits: LimitsInForce
    step_us: float
    unsolved: int
    iterations: int = 1

    @property
    def leak(self) -> float | None:
        """The largest leak between levels; None with fewer than two levels."""
        return max(level.leak for level in self.levels) if len(self.levels) > 1 else None

    @property
    def kkt_residual(self) -> float:
        """The largest scaled KKT residual over the points that were applied."""
        return max((level.kkt_residual for level in self.levels), default=0.0)

    def binding(self, joint_names: tuple[str, ...]) -> list[Binding]:
        """Every active constraint in words, level by level."""
        return [
            Binding(
                level.name,
                joint_names[joint],
                kind,
                "upper" if multiplier > 0 else "lower",
                knot,
                abs(multiplier),
                slack,
            )
            for level in self.levels
            for kind, knot, joint, multiplier, slack in level.active.labelled(self.rows)
        ]

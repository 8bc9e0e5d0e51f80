"""The plan of one step of a velocity-level controller, with its evidence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from himpc.htmpc.kernel.kinds import KINDS
from himpc.htmpc.prediction import Motion
from himpc.htmpc.settings import MotionBounds
from himpc.plan import Binding
from robots.arrays import Array, Integers


class ActiveMotionRows(NamedTuple):
    """Active constraint rows: kind, knot and part as in `ConstraintRows`, and the multipliers, all (r,).
    `name` is the pair of a row of a distance, the coordinate of a row of (12), the cost of a row of (11), and
    "" for the rows of a joint."""

    kind: Integers
    knot: Integers
    part: Integers
    multiplier: Array
    name: tuple[str, ...]

    def __len__(self) -> int:
        return self.kind.size

    def labelled(self, joints: Sequence[str]) -> list[tuple[str, int, str, float, float]]:
        """Returns (label, knot, name, multiplier, slack) of each active row."""
        kinds, knots, parts, multipliers, names = self
        rows = zip(kinds.tolist(), knots.tolist(), parts.tolist(), multipliers.tolist(), names, strict=True)
        return [(KINDS[kind], knot, name or joints[int(part)], m, 0.0) for kind, knot, part, m, name in rows]


class LevelEvidence(NamedTuple):
    """The solution of one level and its verification.

    Attributes:
        name: name of the level.
        status: status of the solver at the last QP.
        fallback: "solve", or the fallback that was needed. "widened": limits were widened to contain full
            braking. "keep": there was no verified point, and the inputs of the level above were kept; on the
            first level the robot brakes.
        kkt_residual: largest scaled KKT residual of the applied QP solutions.
        best: e* at knots 1 … N, (N, m); the level's tasks stacked.
        final: the same errors after all levels were solved.
        cost: J of (8) at e*, without knot 0.
        steps: accepted step sizes, one per iteration; 0 if none was acceptable.
        iterations: number of solved QPs; second attempts are not counted.
        unsolved: number of these QPs that had no verified point.
        time_us: wall time.
        active: constraints with a nonzero multiplier in the last QP.
    """

    name: str
    status: str
    fallback: str
    kkt_residual: float
    best: Array
    final: Array
    cost: float
    steps: tuple[float, ...]
    iterations: int
    unsolved: int
    time_us: float
    active: ActiveMotionRows

    @property
    def step(self) -> float:
        """The mean accepted step size; NaN if no QP was solved."""
        return float(np.mean(self.steps)) if self.steps else float("nan")


class VelocityPlan(NamedTuple):
    """The planned motion, and the solution of every level.

    Attributes:
        command: v at the end of this control period, (n,), for robots that hold one command per period.
            `motion.velocity(s)` returns v at any time s after this step.
        motion: the plan as a function of time.
        q, v: predicted positions and velocities at knots 0 … N, (N+1, n).
        u: accelerations, (N, n).
        levels: one per active level, highest priority first.
        errors: e now, (m,), per task name.
        values: x now, per task name.
        bounds: the bounds that apply now.
        clearance: m, the smallest signed distance to an obstacle along the plan; infinite if none is near.
        step_us: wall time from state to plan, microseconds, kinematics included.
        notice: one sentence for the user if the controller could not do what was asked; None otherwise.
    """

    command: Array
    motion: Motion
    q: Array
    v: Array
    u: Array
    levels: tuple[LevelEvidence, ...]
    errors: dict[str, Array]
    values: dict[str, Array]
    bounds: MotionBounds
    clearance: float
    step_us: float
    notice: str | None = None

    def binding(self, joint_names: Sequence[str]) -> list[Binding]:
        """Returns all active constraints, level by level."""
        return [
            binding
            for level in self.levels
            for binding in Binding.of(level.name, level.active.labelled(joint_names))
        ]

    @property
    def unsolved(self) -> int:
        """Number of QPs that had no verified point at the first attempt."""
        return sum(level.unsolved for level in self.levels)

    @property
    def leak(self) -> float | None:
        """max(|e_p| − |e_p*|) over knots, coordinates and all levels but the last; None with fewer than two
        levels."""
        above = self.levels[:-1]
        return max((float((np.abs(p.final) - np.abs(p.best)).max()) for p in above), default=None)

    @property
    def kkt_residual(self) -> float:
        """The largest scaled KKT residual over the points that were applied."""
        return max((level.kkt_residual for level in self.levels), default=0.0)

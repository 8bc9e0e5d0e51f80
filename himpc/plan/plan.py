"""The plan of one control tick, with its evidence."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence, Sized
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

from himpc.cascade.level import LevelSolution
from himpc.limits import LimitsInForce, Rows
from himpc.telemetry import Layout
from robots.arrays import Array


class Binding(NamedTuple):
    """An active constraint: the names of its level and of its joint or direction, its bound and its
    multiplier."""

    level: str
    joint: str
    kind: str
    side: str
    knot: int
    multiplier: float
    slack: float

    @classmethod
    def of(cls, level: str, rows: Iterable[tuple[str, int, str, float, float]]) -> list[Binding]:
        """Returns the active constraints of a level from (label, knot, name of the joint or direction,
        multiplier, slack) of each."""
        return [
            cls(level, name, label, "upper" if multiplier > 0 else "lower", knot, abs(multiplier), slack)
            for label, knot, name, multiplier, slack in rows
        ]


class SolvedLevel(Protocol):
    """The data that a solved level has at torque level (`LevelSolution`) and at velocity level
    (`himpc.htmpc.plan.LevelEvidence`)."""

    @property
    def name(self) -> str: ...
    @property
    def cost(self) -> float: ...
    @property
    def kkt_residual(self) -> float: ...
    @property
    def fallback(self) -> str: ...
    @property
    def time_us(self) -> float: ...
    @property
    def active(self) -> Sized: ...


class TickPlan(Protocol):
    """What plans share at torque level (`Plan`) and at velocity level (`himpc.htmpc.VelocityPlan`)."""

    @property
    def levels(self) -> Sequence[SolvedLevel]: ...
    @property
    def q(self) -> Array: ...
    @property
    def step_us(self) -> float: ...
    @property
    def unsolved(self) -> int: ...
    @property
    def leak(self) -> float | None: ...
    @property
    def notice(self) -> str | None: ...
    def binding(self, joint_names: tuple[str, ...]) -> list[Binding]: ...


class Evidence(NamedTuple):
    """The results of a tick except the torque; for the attributes see `Plan`."""

    levels: tuple[LevelSolution, ...]
    q: Array
    errors: dict[str, Array]
    values: dict[str, Array]
    rows: Rows


class AtOnce(NamedTuple):
    """The increments of the levels at this tick.

    Attributes:
        increments: Δτ_{i,k|k} of every level, highest priority first, (r, n) N·m.
        jacobians: J_i at the measured state, (m_i, n), of all levels but the last.
    """

    increments: Array
    jacobians: list[Array]


class Behind(NamedTuple):
    """The effect of a filter that follows the levels on their torque.

    Attributes:
        solution: the filter's step from τ₀, the bounds that are active at this step, and the filter's leak
            into the levels.
        rows: the rows that the solution's indices refer to.
    """

    solution: LevelSolution
    rows: Rows


@dataclass(frozen=True, eq=False)
class Plan:
    """The first input, the prediction, and the solution of every level.

    A plan refers to data of its controller that are valid until the next tick. Call `freeze` to store a plan
    longer. Results that were already read are copies and stay valid.

    Attributes:
        tau: torque to apply now, (n,) N·m: τ₀ + Δτ*_{r,k|k}, inside the torque bounds; for controllers
            without bounds (OSF, TDEOSF) the demanded torque.
        tau_0: torque that was applied last, (n,) N·m.
        limits: the bounds in force.
        step_us: wall time from state to torque, microseconds, kinematics included.
        unsolved: number of QPs that had no verified point at the first attempt.
        find_evidence: collects the other results when they are read for the first time. Raises RuntimeError
            if the controller has computed another tick in between.
        iterations: number of times that the cascade was solved; always 1 except for NHIMPC.
        notice: a sentence for the user after the first failure of the user's own code; None otherwise.
        fill: writes all known fields, references included, into a row of telemetry in one operation. Returns
            False if this is not possible. None: fields are written one by one.
        at_once: returns the increments of the levels at this tick without further computation; None: see
            `levels`.
        M_bar: diagonal of the M̄ of this plan, (n,) kg·m²; None: the M̄ of the settings.
        behind: the effect of a filter that follows the levels; None without a filter.
    """

    tau: Array
    tau_0: Array
    limits: LimitsInForce
    step_us: float
    unsolved: int
    find_evidence: Callable[[], Evidence]
    iterations: int = 1
    notice: str | None = None
    fill: Callable[[Array, Layout], bool] | None = None
    at_once: Callable[[], AtOnce] | None = None
    M_bar: Array | None = None
    behind: Behind | None = None

    def freeze(self) -> Plan:
        """Collects all results, which then stay valid, and returns the plan."""
        _ = self.evidence
        return self

    @cached_property
    def evidence(self) -> Evidence:
        """The results except the torque."""
        return self.find_evidence()

    @property
    def levels(self) -> tuple[LevelSolution, ...]:
        """One solution per active level, highest priority first."""
        return self.evidence.levels

    @property
    def q(self) -> Array:
        """Predicted positions at knots 0 … N, (N+1, n)."""
        return self.evidence.q

    @property
    def errors(self) -> dict[str, Array]:
        """x̃ per task name, (m,) each."""
        return self.evidence.errors

    @property
    def values(self) -> dict[str, Array]:
        """x per task name."""
        return self.evidence.values

    @property
    def rows(self) -> Rows:
        """The bounds of the last level's problem."""
        return self.evidence.rows

    @property
    def leak(self) -> float | None:
        """The largest leak between levels. If a filter follows the levels, its leak into the levels counts
        too. None if there are fewer than two levels."""
        if len(self.levels) < 2:
            return None
        between = max(level.leak for level in self.levels)
        return between if self.behind is None else max(between, self.behind.solution.leak)

    @property
    def kkt_residual(self) -> float:
        """The largest scaled KKT residual over the points that were applied."""
        return max((level.kkt_residual for level in self.levels), default=0.0)

    def binding(self, joint_names: tuple[str, ...]) -> list[Binding]:
        """Returns all active constraints, with names instead of indices: level by level, then those of a
        filter that follows the levels."""
        pairs = [(level, self.rows) for level in self.levels]
        return [
            binding
            for level, rows in (pairs if self.behind is None else [*pairs, self.behind])
            for binding in Binding.of(level.name, level.active.labelled(rows, joint_names))
        ]

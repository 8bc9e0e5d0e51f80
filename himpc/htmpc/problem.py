"""STMPC (9) for one level: its cost, its Gauss-Newton model and its constraints at an iterate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from himpc.htmpc.active_set import ActiveSetSolver
from himpc.htmpc.clearance import PENALTY, Avoidance, Clearances
from himpc.htmpc.cost import Effort, barrier, barrier_value, gauss_newton
from himpc.htmpc.kernel.kinds import LEXICOGRAPHIC
from himpc.htmpc.kernel.rows import guard
from himpc.htmpc.kinematics import Desired, Knots
from himpc.htmpc.prediction import Start, braking, coasting, integrator
from himpc.htmpc.rows import ConstraintRows, ConstraintTable
from himpc.htmpc.settings import HTMPCSettings, MotionBounds
from himpc.htmpc.tracking import Guard, Tracking
from robots import Robot
from robots.arrays import Array

PROXIMAL = 0.03
"""Factor on the effort weights in the proximal form, which serves damping only. With the full weights, a
level would have errors of centimetres late in its horizon. By (12), the levels below would then be allowed
the same errors."""
_RIDGE = 1e-8
"""Added to the diagonal of the Hessian, which is then positive definite even if effort weights are zero."""


@dataclass(frozen=True, eq=False)
class SharedStep:
    """Data that all levels of one step share.

    Attributes:
        robot, data: used for kinematics.
        settings: the present settings.
        start: initial state of the prediction.
        desired: r per task name at knots 0 … N.
        effort: J_eff.
        rows: (7d) on the inputs.
        bounds: the bounds that apply now.
        plan: the shifted previous plan, (N, n).
        avoidance: (7c), None without obstacles.
        method: solves the QPs; it stores the active rows of a level's last QP.
        table: has space for all rows; its first rows are `rows`.
    """

    robot: Robot
    data: pin.Data
    settings: HTMPCSettings
    start: Start
    desired: dict[str, Desired]
    effort: Effort
    rows: ConstraintRows
    bounds: MotionBounds
    plan: Array
    avoidance: Avoidance | None
    method: ActiveSetSolver
    table: ConstraintTable

    @cached_property
    def brake(self) -> Array:
        """Inputs (N, n) that stop the robot. They are used if bounds contradict each other."""
        settings = self.settings
        return braking(self.start, settings.horizon, settings.dt, settings.period, self.bounds)

    @cached_property
    def rest(self) -> tuple[float, Array]:
        """Value and gradient (N·n,) of (10) for inputs of zero."""
        return self.effort.absolute(self.start, np.zeros_like(self.plan))

    @cached_property
    def coasting(self) -> Array:
        """q at knots 1 … N for inputs of zero, (N, n)."""
        return coasting(self.start, self.settings.horizon, self.settings.dt)

    @cached_property
    def T_q(self) -> Array:
        """∂q_k/∂u_s, (N, N)."""
        return integrator(self.settings.horizon, self.settings.dt).T_q

    def iterate(self, U: Array) -> Iterate:
        """Returns inputs (N, n) together with their kinematics and costs."""
        return Iterate(self, U)


class Iterate:
    """Inputs with their kinematics and distances, each computed once and only when needed."""

    def __init__(self, tick: SharedStep, U: Array) -> None:
        self.tick = tick
        self.U = U
        self.q = tick.coasting + tick.T_q @ U
        self.knots = Knots(tick.robot, tick.data, self.q)
        self._errors: dict[str, Array] = {}
        self._jacobians: dict[str, Array] = {}
        self._efforts: dict[bool, tuple[float, Array]] = {}

    def errors(self, level: Tracking) -> Array:
        """Returns e at knots 1 … N, (N, m)."""
        errors = self._errors.get(level.name)
        if errors is None:
            errors = self._errors[level.name] = level.errors(self.knots, self.tick.desired)
        return errors

    def jacobian(self, level: Tracking) -> Array:
        """Returns ∂e_k/∂q_k at knots 1 … N, (N, m, n)."""
        if level.name not in self._jacobians:
            self._jacobians[level.name] = level.jacobian(self.knots, self.tick.desired)
        return self._jacobians[level.name]

    def effort(self, absolute: bool) -> tuple[float, Array]:
        """Returns value and gradient (N·n,) of J_eff: (10) itself, or its proximal form."""
        effort = self._efforts.get(absolute)
        if effort is None:
            tick = self.tick
            if absolute:
                effort = tick.effort.about(tick.rest, self.U)
            else:
                value, slope = tick.effort.relative(self.U, tick.plan)
                effort = PROXIMAL * value, PROXIMAL * slope
            self._efforts[absolute] = effort
        return effort

    @cached_property
    def near(self) -> Clearances | None:
        """Distances and their gradients; None without obstacles."""
        avoidance = self.tick.avoidance
        return avoidance.near(self.knots.joints) if avoidance is not None else None

    @cached_property
    def distances(self) -> Clearances | None:
        """Distances; they include gradients only if `near` was computed before. None without obstacles."""
        avoidance = self.tick.avoidance
        if avoidance is None or "near" in self.__dict__:
            return self.near
        return avoidance.near(self.knots.joints, gradients=False)

    @cached_property
    def depths(self) -> Array:
        """Violation of the safety margin at each knot, (N,) m."""
        avoidance, distances = self.tick.avoidance, self.distances
        if avoidance is None or distances is None:
            return np.zeros(len(self.U))
        return avoidance.depths(distances, len(self.U))


@dataclass(frozen=True, eq=False)
class Problem:
    """The problem of one level.

    Attributes:
        tick: data that all levels share.
        level: the level to optimise.
        guards: constraints (9c) of the levels above, highest first.
        absolute: whether the effort is (10) itself, or its proximal form.
    """

    tick: SharedStep
    level: Tracking
    guards: tuple[Guard, ...]
    absolute: bool

    @property
    def softened(self) -> bool:
        """Whether barriers soften the constraints on states and inputs, as in the paper."""
        return self.tick.settings.formulation == "paper"

    @property
    def forced(self) -> bool:
        """Whether slacks are variables of the QP: only on the first level."""
        return not self.guards and not self.softened

    @property
    def corrects(self) -> bool:
        """Whether a step that violates (13) first gets a second-order correction (not in the paper)."""
        return bool(self.guards) and not self.softened

    def merit(self, at: Iterate) -> float:
        """Returns J_l + J_eff, with barriers or penalties for (7c) and (7d)."""
        tick = self.tick
        value = self.level.cost(at.errors(self.level)) + at.effort(self.absolute)[0]
        if self.softened:
            return value + barrier_value(self._soft_rows(at), at.U.ravel())
        return value + PENALTY * float(at.depths.sum()) if tick.avoidance is not None else value

    def model(self, at: Iterate) -> tuple[Array, Array]:
        """Returns the Hessian (k, k) and the gradient (k,) with respect to the inputs. The Hessian of the
        errors is the Gauss-Newton approximation."""
        tick = self.tick
        H, g = gauss_newton(
            *(at.jacobian(self.level), self.level.Q, at.errors(self.level), tick.T_q),
            *(tick.effort.hessian, 1.0 if self.absolute else PROXIMAL, _RIDGE),
        )
        g += at.effort(self.absolute)[1]
        if self.softened:
            _, slope, curvature = barrier(self._soft_rows(at), at.U.ravel())
            H, g = H + curvature, g + slope
        return H, g

    def rows(self, at: Iterate, slopes: Iterate | None = None) -> ConstraintRows:
        """Returns the QP's rows for the change d of the inputs, without rows that are softened by barriers or
        slacks.

        With `slopes`, the rows correct a step that violated the guards. The guards' rows are then strict and
        have the Jacobians of the iterate `slopes`. All rows are in the step's table; the next call overwrites
        the rows after (7d).
        """
        tick, table = self.tick, self.tick.table
        first = row = len(tick.rows.A)
        if not self.softened:
            table.about(at.U.ravel(), row)
            first = 0
        for above in self.guards:
            row = self._guarded(above, row, at, slopes)
        if self.guards and not self.softened and at.near is not None and len(at.near.knot):
            # Below the first level, the present violation is allowed: d = 0 satisfies the rows.
            rows = self._avoidance_rows(at, row)
            row = table.put(row, rows.widened(np.zeros(at.U.size)))
        return table.changes(first, row)

    def _guarded(self, above: Guard, row: int, at: Iterate, slopes: Iterate | None) -> int:
        """Writes (12) or (11) for a level above into the table; returns the index after its rows."""
        tick, table, strict = self.tick, self.tick.table, slopes is not None
        e, J = at.errors(above.tracking), (slopes or at).jacobian(above.tracking)
        if tick.settings.lexicographic == "per_coordinate":
            table.reserve(row + e.size)
            guard(J, e, above.best, strict, tick.T_q, row, table.A, table.room, table.labels)
            return row + e.size
        pull = np.einsum("km,kmj->kj", above.tracking.Q * e, J)
        table.reserve(row + 1)
        table.A[row] = (tick.T_q.T @ pull).ravel()
        table.room[:, row] = -np.inf, above.gap(e, strict)
        table.labels[:, row] = LEXICOGRAPHIC, tick.settings.horizon, 0
        return row + 1

    def with_slack(self, at: Iterate, rows: ConstraintRows) -> tuple[ConstraintRows, int]:
        """Returns `rows` of an iterate and the number of rows of (7c). On the first level, the rows of (7c),
        which slacks may relax, are appended to `rows`."""
        if not self.forced or at.near is None or not len(at.near.knot):
            return rows, 0
        slack, row = self._avoidance_rows(at, len(rows.A)), len(rows.A)
        return self.tick.table.changes(0, self.tick.table.put(row, slack)), len(slack.A)

    @property
    def unchanging(self) -> int:
        """The number of rows, from the first on, whose coefficients stay the same when a step is
        corrected."""
        guarded = 0
        if self.tick.settings.lexicographic == "per_coordinate":
            guarded = sum(guard.best.size for guard in self.guards)
        return guarded + (0 if self.softened else len(self.tick.rows.A))

    def allowed(self, at: Iterate, share: float = 1.0) -> bool:
        """Returns whether the error of every level above has grown by at most `share` times its tolerance, as
        in (13)."""
        settings = self.tick.settings
        per_coordinate = settings.lexicographic == "per_coordinate"
        delta = share * settings.delta_m
        return all(
            above.excess(at.errors(above.tracking), per_coordinate, delta) <= 0.0 for above in self.guards
        )

    def _avoidance_rows(self, at: Iterate, row: int) -> ConstraintRows:
        avoidance, tick = self.tick.avoidance, self.tick
        assert avoidance is not None
        assert at.near is not None
        return avoidance.rows(at.near, len(at.U), tick.settings.dt, tick.table, row)

    def _soft_rows(self, at: Iterate) -> ConstraintRows:
        """Returns (7d) and (7c) on the inputs."""
        hard = self.tick.rows
        if at.near is None or not len(at.near.knot):
            return hard
        near = self._avoidance_rows(at, len(hard.A))
        return ConstraintRows(
            self.tick.table.A[: len(hard.A) + len(near.A)],
            np.concatenate([hard.lower, near.lower + near.A @ at.U.ravel()]),
            np.concatenate([hard.upper, near.upper]),
            np.concatenate([hard.kind, near.kind]),
            np.concatenate([hard.knot, near.knot]),
            np.concatenate([hard.part, near.part]),
        )

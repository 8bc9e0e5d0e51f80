"""STMPC (9) for one level: its cost, its Gauss-Newton model and its constraints at an iterate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from himpc.htmpc.active_set import ActiveSet
from himpc.htmpc.avoidance import PENALTY, Avoidance
from himpc.htmpc.clearance import Clearances
from himpc.htmpc.cost import Effort, barrier, barrier_value, gauss_newton
from himpc.htmpc.kinematics import Desired, Knots
from himpc.htmpc.prediction import Start, braking, integrator, positions
from himpc.htmpc.rows import KINDS, Rows, Table
from himpc.htmpc.settings import Bounds, HTMPCSettings
from himpc.htmpc.tracking import Guard, Tracking
from robots import Robot

Array = NDArray[np.float64]
_Part = tuple[NDArray[Any], ...]
"""Bounds and labels of some rows."""

PROXIMAL = 0.03
"""Share of the effort weights that the proximal form has. It only damps: with the full weights a level keeps
errors of centimetres late in its horizon, which (12) then grants to the levels below."""
_LEXICOGRAPHIC = KINDS.index("lexicographic")
_RIDGE = 1e-8
"""Keeps the Hessian positive definite when effort weights are set to zero."""


@dataclass(frozen=True, eq=False)
class Tick:
    """What all levels of one step share.

    Attributes:
        robot, data: for kinematics.
        settings: in use.
        start: where the prediction begins.
        desired: r per task name at knots 0 … N.
        effort: J_eff.
        rows: (7d) on the inputs.
        bounds: in force.
        plan: the shifted previous plan, (N, n).
        avoidance: (7c), None if there is nothing to avoid.
        method: solves the QPs; it remembers the last one of a level.
        table: has room for all rows; `rows` are its first.
    """

    robot: Robot
    data: pin.Data
    settings: HTMPCSettings
    start: Start
    desired: dict[str, Desired]
    effort: Effort
    rows: Rows
    bounds: Bounds
    plan: Array
    avoidance: Avoidance | None
    method: ActiveSet
    table: Table

    @cached_property
    def brake(self) -> Array:
        """Inputs that stop the robot, (N, n); what is left when bounds contradict each other."""
        settings = self.settings
        return braking(self.start, settings.horizon, settings.dt, settings.period, self.bounds)

    @cached_property
    def rest(self) -> tuple[float, Array]:
        """Value and gradient (N·n,) of (10) without inputs."""
        return self.effort.absolute(self.start, np.zeros_like(self.plan))

    def iterate(self, U: Array) -> Iterate:
        """Inputs (N, n) with what follows from them."""
        return Iterate(self, U)


class Iterate:
    """Inputs with the kinematics and distances that follow, each computed once and only when needed."""

    def __init__(self, tick: Tick, U: Array) -> None:
        self.tick = tick
        self.U = U
        self.q = positions(tick.start, U, tick.settings.dt)
        self.knots = Knots(tick.robot, tick.data, self.q)
        self._errors: dict[str, Array] = {}
        self._jacobians: dict[str, Array] = {}

    def errors(self, level: Tracking) -> Array:
        """e at knots 1 … N, (N, m)."""
        found = self._errors.get(level.name)
        if found is None:
            found = self._errors[level.name] = level.errors(self.knots, self.tick.desired)
        return found

    def jacobian(self, level: Tracking) -> Array:
        """∂e_k/∂q_k at knots 1 … N, (N, m, n)."""
        if level.name not in self._jacobians:
            self._jacobians[level.name] = level.jacobian(self.knots)
        return self._jacobians[level.name]

    @cached_property
    def near(self) -> Clearances | None:
        """Distances with gradients; None if there is nothing to avoid."""
        avoidance = self.tick.avoidance
        return avoidance.near(self.knots.joints) if avoidance is not None else None

    @cached_property
    def distances(self) -> Clearances | None:
        """Distances, with gradients only if they are known already; None if there is nothing to avoid."""
        avoidance = self.tick.avoidance
        if avoidance is None or "near" in self.__dict__:
            return self.near
        return avoidance.near(self.knots.joints, gradients=False)

    @cached_property
    def depths(self) -> Array:
        """By how much each knot is inside the safety margin, (N,) m."""
        avoidance, distances = self.tick.avoidance, self.distances
        if avoidance is None or distances is None:
            return np.zeros(len(self.U))
        return avoidance.depths(distances, len(self.U))


@dataclass(frozen=True, eq=False)
class Problem:
    """One level.

    Attributes:
        tick: shared data.
        level: the level to optimise.
        guards: what the levels above have reached, highest first.
        absolute: whether the effort is (10) itself, or its proximal form.
    """

    tick: Tick
    level: Tracking
    guards: tuple[Guard, ...]
    absolute: bool

    @property
    def softened(self) -> bool:
        """Whether states and inputs are softened by barriers, as the paper says."""
        return self.tick.settings.formulation == "paper"

    @property
    def forced(self) -> bool:
        """Whether slacks belong to the unknowns: only the first level may buy them."""
        return not self.guards and not self.softened

    @property
    def corrects(self) -> bool:
        """Whether a step that (13) refuses may be bent back before it is shortened: not in the paper."""
        return bool(self.guards) and not self.softened

    def merit(self, at: Iterate) -> float:
        """J_l + J_eff, with barriers or penalties for (7c) and (7d)."""
        tick = self.tick
        value = self.level.cost(at.errors(self.level)) + self._effort(at.U)[0]
        if self.softened:
            return value + barrier_value(self._soft_rows(at), at.U.ravel())
        return value + PENALTY * float(at.depths.sum()) if tick.avoidance is not None else value

    def model(self, at: Iterate) -> tuple[Array, Array]:
        """Hessian (k, k), Gauss-Newton for the errors, and gradient (k,) with respect to the inputs."""
        tick, N, dt = self.tick, self.tick.settings.horizon, self.tick.settings.dt
        H, g = gauss_newton(
            *(at.jacobian(self.level), self.level.Q, at.errors(self.level), integrator(N, dt).T_q),
            *(tick.effort.hessian, 1.0 if self.absolute else PROXIMAL, _RIDGE),
        )
        g = g + self._effort(at.U)[1]
        if self.softened:
            _, slope, curvature = barrier(self._soft_rows(at), at.U.ravel())
            H, g = H + curvature, g + slope
        return H, g

    def rows(self, at: Iterate, slopes: Iterate | None = None) -> Rows:
        """The QP's rows for the change d of the inputs, without those that are softened.

        With `slopes` they lead back: the guards' rows are strict, and have the Jacobians of that iterate.
        They are views of the tick's table; the next call fills it anew behind the rows of (7d).
        """
        tick = self.tick
        first = place = len(tick.rows.A)
        parts: list[_Part] = []
        if not self.softened:
            limits, first = tick.rows.about(at.U.ravel()), 0
            parts.append(limits[1:])
        for guard in self.guards:
            bounds = self._guarded(guard, place, at, slopes)
            parts.append(bounds)
            place += len(bounds[0])
        if not self.softened and at.near is not None and len(at.near.knot) and self.guards:
            # Below the first level the depth reached is kept: the rows contain d = 0.
            rows = self._avoidance_rows(at, place)
            parts.append(rows.widened(np.zeros(at.U.size))[1:])
            place += len(rows.A)
        return _stacked(tick.table.A[first:place], *parts)

    def _guarded(self, guard: Guard, place: int, at: Iterate, slopes: Iterate | None) -> _Part:
        """Writes (12) or (11) for a level above into the table; returns its bounds and labels."""
        settings, table, strict = self.tick.settings, self.tick.table, slopes is not None
        N, T_q = settings.horizon, integrator(settings.horizon, settings.dt).T_q
        e, J = at.errors(guard.tracking), (slopes or at).jacobian(guard.tracking)
        if settings.lexicographic == "per_coordinate":
            knots, parts = np.divmod(np.arange(e.size), e.shape[1])
            if not strict:  # else they are there
                table.spread(place, knots, J.reshape(e.size, -1), T_q)
            return *guard.room(e, strict), np.full(e.size, _LEXICOGRAPHIC), knots + 1, parts
        pull = np.einsum("km,kmj->kj", guard.tracking.Q * e, J)
        table.reserve(place + 1)
        table.A[place] = (T_q.T @ pull).ravel()
        bounds = np.array([-np.inf]), np.array([guard.gap(e, strict)])
        return *bounds, np.array([_LEXICOGRAPHIC]), np.array([N]), np.array([0])

    def both(self, rows: Rows, slack: Rows) -> Rows:
        """`rows` and `slack_rows` of the same iterate: they stand side by side in the table."""
        return _stacked(self.tick.table.A[: len(rows.A) + len(slack.A)], rows[1:], slack[1:])

    @property
    def unchanging(self) -> int:
        """How many of the first `rows` are the same, but for their bounds, when a step is led back."""
        guarded = 0
        if self.tick.settings.lexicographic == "per_coordinate":
            guarded = sum(guard.best.size for guard in self.guards)
        return guarded + (0 if self.softened else len(self.tick.rows.A))

    def slack_rows(self, at: Iterate) -> Rows | None:
        """(7c) for the first level, whose violation it buys; None if nothing is near."""
        if not self.forced or at.near is None or not len(at.near.knot):
            return None
        return self._avoidance_rows(at, len(self.tick.rows.A))

    def allowed(self, at: Iterate, share: float = 1.0) -> bool:
        """(13): whether no level above has got worse by more than (a share of) its tolerance."""
        settings = self.tick.settings
        per_coordinate = settings.lexicographic == "per_coordinate"
        return all(
            guard.excess(at.errors(guard.tracking), per_coordinate, share * settings.delta_m) <= 0.0
            for guard in self.guards
        )

    def _effort(self, U: Array) -> tuple[float, Array]:
        effort = self.tick.effort
        if self.absolute:
            return effort.about(self.tick.rest, U)
        value, slope = effort.relative(U, self.tick.plan)
        return PROXIMAL * value, PROXIMAL * slope

    def _avoidance_rows(self, at: Iterate, place: int) -> Rows:
        avoidance, tick = self.tick.avoidance, self.tick
        assert avoidance is not None
        assert at.near is not None
        return avoidance.rows(at.near, len(at.U), tick.settings.dt, tick.table, place)

    def _soft_rows(self, at: Iterate) -> Rows:
        if at.near is None or not len(at.near.knot):
            return self.tick.rows
        place = len(self.tick.rows.A)
        rows = self._avoidance_rows(at, place)
        every = self.tick.table.A[: place + len(rows.A)]
        moved = rows._replace(lower=rows.lower + rows.A @ at.U.ravel())
        return _stacked(every, self.tick.rows[1:], moved[1:])


def _stacked(A: Array, *parts: _Part) -> Rows:
    """Rows whose bounds and labels come in parts."""
    if not parts:
        nothing = np.zeros(0, np.int64)
        return Rows(A, np.zeros(0), np.zeros(0), nothing, nothing, nothing)
    lower, upper, kind, knot, part = (np.concatenate(each) for each in zip(*parts, strict=True))
    return Rows(A, lower, upper, kind, knot, part)

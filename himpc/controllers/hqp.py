"""HQP: one-step hierarchical quadratic programming on the nominal model, [16] of the HIMPC paper."""

from __future__ import annotations

from time import perf_counter_ns
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import NO_ROWS, ActiveRows, Fallback, LevelSolution
from himpc.controllers.null_space_control import split
from himpc.controllers.one_step import Demand, Law, OneStepController, leak
from himpc.formulation.settings import Settings
from himpc.limits import Rows
from himpc.qp import solve_qp
from robots import NominalModel

Array = NDArray[np.float64]

_BINDING = 1e-9
"""A row is active if two conditions hold: its multiplier exceeds _BINDING, and its distance from its bound is
below 1000 · _BINDING, N·m."""


_REST = 5.0
"""1/s: K_v of the last fallback, q̈ = −K_v q̇ within the torque bounds. It is used if the first QP has no
verified point."""


class VerifiedOptimum(NamedTuple):
    """The optimum y of a level with its verification."""

    y: Array
    active: ActiveRows = NO_ROWS
    kkt_residual: float = 0.0
    status: str = "optimal"
    qp_us: float = 0.0
    usable: bool = True


class HQP(OneStepController):
    """Level i: min over y = τ − N_n of ‖J_i M_n⁻¹ y − (ẍ_i − J̇_i q̇)‖²_Q + ‖y‖²_R within the torque bounds.

    Priority: J_p M_n⁻¹ y_i = J_p M_n⁻¹ y_p for all levels p above, as in (34g) with the nominal M_n
    (`settings.nominal`) in place of M̄. ẍ_i is the acceleration that (4) demands with the gains of the tasks.
    As in section V only the torque is bounded; velocity and position limits are not imposed.

    [16] writes the same cost with the force Λ_n (ẍ_i − J̇_i q̇), and Λ_n = (J M_n⁻¹ Jᵀ)⁻¹ does not exist at a
    singularity. This form needs no inverse of a product of Jacobians, and R > 0 keeps every Hessian positive
    definite. y is relative to N_n, so that R does not pull an arm at rest down. If R weighs accelerations, it
    weighs M_n⁻¹ y: the inertia of this law is the nominal one.
    """

    clips = True
    solves = True

    def _adopt(self, settings: Settings) -> None:
        self._nominal = NominalModel(self.robot, settings.nominal)
        self._by_acceleration = settings.R_on == "acceleration"

    def _law(self, q: Array, v: Array, a: Array, demands: list[Demand]) -> Law:
        M, bias = self._nominal.mass_matrix(q), self._nominal.bias(q, v)
        inverse = np.asarray(np.linalg.inv(M), np.float64)
        rows = self._rows(self._limits, bias)
        y, free = np.clip(np.zeros(len(bias)), rows.lower[0], rows.upper[0]), np.eye(len(bias))
        levels: list[LevelSolution] = []
        accelerations: list[Array] = []
        for i, demand in enumerate(demands):
            started = perf_counter_ns()
            B = demand.J @ inverse
            R = np.diag(demand.form.R)
            if self._by_acceleration:
                R = (inverse * demand.form.level.R) @ inverse
            fallback: Fallback = "solve"
            optimum = (
                self._optimum(demand, B, R, y, free, rows)
                if free.shape[1]
                else VerifiedOptimum(y, status="empty")
            )
            if not optimum.usable:
                # A lower level keeps the solution of the levels above, which satisfies every priority. The
                # first level, which has no level above, brings the robot to rest.
                braking = np.clip(-_REST * (M @ v), rows.lower[0], rows.upper[0])
                fallback = "inherit" if i else "brake"
                optimum = VerifiedOptimum(y if i else braking, status=optimum.status, qp_us=optimum.qp_us)
            y = optimum.y
            if i + 1 < len(demands):
                free = free @ split(B @ free, float(np.linalg.norm(B)))[3]
            accelerations.append(inverse @ y)
            error = demand.residual(B @ y)
            increment = bias + y - self._tau_0
            levels.append(
                LevelSolution(
                    name=demand.form.level.name,
                    U=y[None],
                    cost=float(error @ error + increment @ R @ increment),
                    active=optimum.active,
                    kkt_residual=optimum.kkt_residual,
                    status=optimum.status,
                    fallback=fallback,
                    time_us=(perf_counter_ns() - started) / 1e3,
                    qp_us=optimum.qp_us,
                    leak=leak(demands, accelerations, i),
                )
            )
        return Law(bias, levels)

    def _optimum(
        self, demand: Demand, B: Array, R: Array, y: Array, free: Array, rows: Rows
    ) -> VerifiedOptimum:
        """Solves the level's QP over w in y_i = y_{i−1} + Z w with Z = `free`: the priorities hold
        exactly."""
        weighted = demand.form.root_Q[:, None] * B
        H = free.T @ (weighted.T @ weighted + R) @ free
        f = free.T @ (weighted.T @ demand.residual(B @ y) + R @ y)
        # y satisfies the bounds up to rounding; this point must stay feasible exactly.
        lower, upper = np.minimum(rows.lower[0] - y, 0.0), np.maximum(rows.upper[0] - y, 0.0)
        solution = solve_qp(H, f, free, lower, upper, self._settings.solver)
        if not solution.solved:
            return VerifiedOptimum(y, status=solution.status, qp_us=solution.time_us, usable=False)
        step = free @ solution.x
        active = _binding(solution.multipliers, step, lower, upper)
        return VerifiedOptimum(y + step, active, solution.kkt_residual, solution.status, solution.time_us)


def _binding(multipliers: Array, step: Array, lower: Array, upper: Array) -> ActiveRows:
    """Returns the bounds of lower ≤ step ≤ upper that are active and have a multiplier; arguments are
    (n,)."""
    pressed = np.abs(multipliers) > _BINDING
    if not pressed.any():
        return NO_ROWS
    slack = np.where(multipliers > 0, upper - step, step - lower)
    joint = np.flatnonzero(pressed & (slack < 1e3 * _BINDING))
    return ActiveRows(np.zeros_like(joint), joint, multipliers[joint], slack[joint])

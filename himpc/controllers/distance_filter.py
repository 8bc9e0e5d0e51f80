"""A safety filter. Of all torques that keep distances, it chooses the one closest to the argument."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import NO_ROWS, ActiveRows
from himpc.formulation.settings import Settings
from himpc.limits import TORQUE, LimitsInForce, Rows
from himpc.limits.constraint import Moment
from himpc.limits.distance import DISTANCE
from himpc.prediction import JointState
from himpc.qp import solve_qp
from himpc.references.outlook import Observed
from himpc.tick.distances import Distances
from robots import Robot

Array = NDArray[np.float64]

_MET = 1e-9
"""N·m: a row with a smaller violation is met. A row with a larger multiplier is active."""
_FAINT = 1e-8
"""Weight of the change of torque when rows are relaxed by least squares."""


class Filtered(NamedTuple):
    """The result of the filter at a tick.

    Attributes:
        tau: (n,) N·m.
        rows: the bounds of the torque and of the distances at the next knot.
        active: the active rows; the slack of a row is its violation, N·m.
        met: whether all rows are met.
    """

    tau: Array
    rows: Rows
    active: ActiveRows
    met: bool


class DistanceFilter:
    """Solves min ‖M̄⁻¹(τ − τ_nom)‖² over τ within the torque bounds, subject to the rows of `limits.distance`
    at the next knot. It is a discrete control-barrier filter; its barrier d has relative degree two.

    The prediction is that of HIMPC, q̈ = q̈₀ + M̄⁻¹(τ − τ₀). The filter does not use tasks and priorities. If
    no torque meets all rows, the rows of distances are relaxed by least squares, and `met` is false.
    """

    def __init__(self, robot: Robot, settings: Settings) -> None:
        self._settings = settings
        self._distances = Distances(robot, settings.limits.avoidance)
        self._v_was: Array | None = None

    def forget(self) -> None:
        """Clears the memory of the last velocity."""
        self._v_was = None

    def __call__(
        self,
        q: Array,
        v: Array,
        tau_0: Array,
        wanted: Array,
        M_bar: Array,
        force: LimitsInForce,
        observed: Observed,
    ) -> Filtered:
        """Filters one torque.

        Args:
            q, v: measured state, (n,), finite.
            tau_0: the torque that acted until now, (n,) N·m.
            wanted: τ_nom, (n,) N·m.
            M_bar: diagonal of M̄, (n,) kg·m².
            force: the bounds in force.
            observed: the objects around the robot.

        Returns:
            for every state, a finite torque within the torque bounds.
        """
        T_s = self._settings.T_s
        v_was, self._v_was = (v if self._v_was is None else self._v_was), v
        state = JointState(q, v, (v - v_was) / T_s)
        near = self._distances.at(q, observed)
        now = Moment(state, tau_0, M_bar, self._settings.limits, force, 1, T_s, near)
        block = DISTANCE.bounds(now)
        assert block.directions is not None
        D = block.directions.D
        rows = Rows(
            np.ones((2, 1)),
            np.vstack([force.tau_lower - tau_0, block.lower]),
            np.vstack([force.tau_upper - tau_0, block.upper]),
            (TORQUE, DISTANCE),
            directions=(None, block.directions),
        )
        bounded = np.flatnonzero(np.isfinite(block.lower[0]))
        demand = np.clip(wanted, force.tau_lower, force.tau_upper)
        # With a = M̄⁻¹(τ − τ_nom) the cost is ‖a‖², and the rows are ∇d·a and M̄ a.
        A = D[bounded] * M_bar
        lower = block.lower[0, bounded] - D[bounded] @ (demand - tau_0)
        if (lower <= 0.0).all() or not np.isfinite(lower).all():
            return Filtered(demand, rows, NO_ROWS, bool(np.isfinite(lower).all()))
        box = force.tau_lower - demand, force.tau_upper - demand
        optimum, slack = _closest(A, lower, np.diag(M_bar), box), np.zeros(len(bounded))
        met = optimum is not None
        if optimum is None:
            slack = _given_way(D[bounded], lower, box)
            optimum = _closest(A, lower - slack, np.diag(M_bar), box)
        if optimum is None:
            return Filtered(demand, rows, NO_ROWS, False)
        a, multiplier = optimum
        tau = np.clip(demand + M_bar * a, force.tau_lower, force.tau_upper)
        binding = np.flatnonzero(np.abs(multiplier) > _MET)
        of_torque = binding >= len(bounded)
        column = np.where(of_torque, binding - len(bounded), bounded[np.minimum(binding, len(bounded) - 1)])
        active = ActiveRows(
            np.where(of_torque, 0, 1),
            column,
            multiplier[binding],
            np.where(of_torque, 0.0, slack[np.minimum(binding, len(bounded) - 1)]),
        )
        return Filtered(tau, rows, active, met)


def _closest(A: Array, lower: Array, M: Array, box: tuple[Array, Array]) -> tuple[Array, Array] | None:
    """Returns the shortest vector a, (n,) rad/s², with A a ≥ lower and M a within the box, and the
    multipliers; None if no such vector exists."""
    upper = np.concatenate([np.full(len(lower), np.inf), box[1]])
    solution = solve_qp(
        np.eye(len(M)), np.zeros(len(M)), np.vstack([A, M]), np.concatenate([lower, box[0]]), upper
    )
    return (solution.x, solution.multipliers) if solution.solved else None


def _given_way(D: Array, lower: Array, box: tuple[Array, Array]) -> Array:
    """Returns the least violation of the rows D δ ≥ lower, by least squares, (r,) N·m, for changes δ of the
    torque within the box."""
    r, n = D.shape
    H = np.diag(np.concatenate([np.full(n, _FAINT), np.ones(r)]))
    rows = np.block([[D, np.eye(r)], [np.eye(n), np.zeros((n, r))]])
    upper = np.concatenate([np.full(r, np.inf), box[1]])
    solution = solve_qp(H, np.zeros(n + r), rows, np.concatenate([lower, box[0]]), upper)
    delta = np.clip(solution.x[:n], *box) if solution.solved else np.zeros(n)
    return np.maximum(lower - D @ delta, 0.0) * (1.0 + _MET) + _MET

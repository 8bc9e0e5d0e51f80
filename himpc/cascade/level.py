"""The data of a level's QP and its solution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np

from himpc.limits.rows import Rows
from robots.arrays import Array, Indices

Fallback = Literal["solve", "soften", "feasible", "previous", "inherit", "brake", "hold"]
FALLBACKS: tuple[Fallback, ...] = get_args(Fallback)


class LevelProblem(NamedTuple):
    """The data of Problem i, (32) or (34): min Σ ‖e_{j+1}‖²_Q + ‖Δτ_j‖²_R, where e is affine in U.

    Attributes:
        name: the level's stable identity.
        B: (N, m, n), Ĵ^j M̄⁻¹ at every knot.
        C: (N, m, N), effect coefficients of `prediction.ResidualModel`.
        free: (N, m), the free response: e for U = 0.
        root_Q: (m,), √Q.
        R: (n,), weight of the increments.
        knots: K ≤ N, the number of knots that this level looks ahead.
    """

    name: str
    B: Array
    C: Array
    free: Array
    root_Q: Array
    R: Array
    knots: int

    def residual(self, U: Array) -> Array:
        """Returns e at knots 1 … N under U, (N, m)."""
        B_U = np.matmul(self.B, U[:, :, None])[:, :, 0]
        return self.free + np.matmul(self.C.transpose(1, 0, 2), B_U.T[:, :, None])[:, :, 0].T

    @property
    def G(self) -> Array:
        """The change of e at knots 1 … K per increment at knots 0 … K−1, (K·m, K·n)."""
        K, (_, m, n) = self.knots, self.B.shape
        return (self.C[:K, :, :K, None] * self.B[:K].transpose(1, 0, 2)).reshape(K * m, K * n)

    @property
    def hessian(self) -> Array:
        """The Hessian GᵀQG + R of half the cost over all N knots, (N·n, N·n)."""
        weighted, N, n = np.tile(self.root_Q, self.knots)[:, None] * self.G, len(self.B), self.R.size
        H = np.diag(np.tile(self.R, N))
        H[: self.knots * n, : self.knots * n] += weighted.T @ weighted
        return H

    def cost(self, U: Array) -> float:
        """Returns the value (32a) or (34a) of U over this level's knots."""
        e, used = self.root_Q * self.residual(U)[: self.knots], U[: self.knots]
        return float(np.vdot(e, e) + np.vdot(self.R * used, used))


@dataclass(frozen=True, slots=True, eq=False)
class ActiveRows:
    """The active rows of `Rows`: indices of row and column, multiplier and slack (N·m in the rows' scaling).
    A column is a joint, or a direction of a constraint that has its own directions. A multiplier is positive
    at an upper bound and negative at a lower bound. If a bound is moved outwards by 1 N·m, the cost (32a) or
    (34a) decreases by twice the multiplier.
    """

    row: Indices
    joint: Indices
    multiplier: Array
    slack: Array

    def __len__(self) -> int:
        return self.row.size

    def labelled(self, rows: Rows, joints: Sequence[str]) -> list[tuple[str, int, str, float, float]]:
        """Returns (label, knot, name of the direction, multiplier, slack) of each active row."""

        def name(row: int, column: int) -> str:
            directions = rows.directions_of(row)
            return joints[column] if directions is None else directions.names[column]

        columns = (column.tolist() for column in (self.row, self.joint, self.multiplier, self.slack))
        return [
            (rows.constraint(row, a, m > 0).label, rows.knot(row), name(row, a), m, s)
            for row, a, m, s in zip(*columns, strict=True)
        ]


NO_ROWS = ActiveRows(np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0), np.empty(0))


class LevelSolution(NamedTuple):
    """The solution of one level with its verification.

    Attributes:
        name: the level's identity.
        U: increments of this level and all levels above, (N, n) N·m.
        cost: the optimal value of the level's cost.
        active: the active constraints.
        kkt_residual: scaled KKT residual of the applied point; 0 for fallbacks that apply no optimum.
        status: "optimal", "empty" (no freedom left) or the status of the solver.
        fallback: name of the fallback that gave U; "solve" if none was needed.
        time_us: wall time of this level, microseconds.
        qp_us: the QP solver's share of `time_us`; 0 if no solver was needed.
        leak: the largest ‖J_p M̄⁻¹(Δτ_i − Δτ_p)‖∞ over all knots and levels p above, m/s² or rad/s².
    """

    name: str
    U: Array
    cost: float
    active: ActiveRows
    kkt_residual: float
    status: str
    fallback: Fallback
    time_us: float
    qp_us: float
    leak: float

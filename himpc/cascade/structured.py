"""The structured route: each level searches only what the levels above leave free."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv  # pyright: ignore[reportAttributeAccessIssue]

from himpc.cascade.level import NO_ROWS, ActiveRows, LevelProblem, Point
from himpc.limits.rows import Rows
from himpc.qp import KKT_TOLERANCE, Solver, solve_qp

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_TOLERANCE = 1e-9
"""N·m: a row violated by less counts as met."""


@dataclass(frozen=True, slots=True, eq=False)
class _Quadratic:
    """½‖y‖² + pullᵀy + ½‖residual + Gy‖² with U = U_above + Y y."""

    U_above: Array | None
    """U_{i−1}, (N, n); None for level 1, where it is zero."""
    N: int
    Y: Array
    G: Array
    residual: Array
    pull: Array

    def increments(self, y: Array) -> Array:
        K, n, d = self.Y.shape
        moved = np.matmul(self.Y, y.reshape(K, d, 1))[:, :, 0]
        if K == self.N:
            return moved if self.U_above is None else moved + self.U_above
        U = np.zeros((self.N, n)) if self.U_above is None else self.U_above.copy()
        U[:K] += moved
        return U

    def row_matrix(self, rows: Rows, row: NDArray[np.intp], joint: NDArray[np.intp]) -> Array:
        """∂(L U)/∂y of the chosen rows, (k, K·d)."""
        K = len(self.Y)
        return (rows.L[row, :K, None] * self.Y.transpose(1, 0, 2)[joint]).reshape(len(row), self.G.shape[1])


def solve_structured(
    problem: LevelProblem, rows: Rows, U_above: Array | None, Z: Array, warm: ActiveRows, solver: Solver
) -> Point | None:
    """Problem i over U = U_{i−1} + Y y, with Y_j a basis of the null space of (33) at knot j.

    The equality constraints (33) hold exactly for every y. Y is scaled so that YᵀRY = I: the cost is
    ½‖y‖² + (YᵀR U_{i−1})ᵀy + ½‖Q^½(e + Gy)‖² and its Hessian I + ĜᵀĜ is solved in the smaller
    of its two dimensions. If that point violates rows, the QP with these and with the rows that were active
    a tick ago is solved, and repeated with more rows until none is violated.

    Args:
        problem: the level's data.
        rows: all bounds.
        U_above: U_{i−1}, (N, n), meets the rows; None for level 1.
        Z: orthonormal bases of what is free, (N, n, d).
        warm: the rows active at this level a tick ago.
        solver: for the QPs with active rows.

    Returns:
        the optimum, or None if the solver gave no point within the KKT tolerance.
    """
    quadratic = _quadratic(problem, U_above, Z)
    point = _without_rows(quadratic)
    violated = None if point is None else _violated(rows, point.U)
    if point is not None and violated is None:
        return point
    mask = np.zeros(rows.lower.shape, bool) if violated is None else violated
    mask[warm.row, warm.joint] = True
    return _with_rows(quadratic, rows, mask, solver)


def _quadratic(problem: LevelProblem, U_above: Array | None, Z: Array) -> _Quadratic:
    K, m = problem.knots, problem.B.shape[1]
    Y = _metric_basis(Z[:K], problem.R)
    d = Y.shape[2]
    W = problem.B[:K] @ Y
    G = (problem.weighted_C[:, :, :, None] * W.transpose(1, 0, 2)).reshape(K * m, K * d)
    if U_above is None:
        free, pull = problem.weighted_free, np.zeros(K * d)
    else:
        free = problem.root_Q * problem.residual(U_above)
        pull = np.matmul((problem.R * U_above[:K])[:, None, :], Y).ravel()
    return _Quadratic(U_above, len(problem.B), Y, G, free[:K].ravel(), pull)


def _metric_basis(Z: Array, R: Array) -> Array:
    """Z scaled so that YᵀRY = I; zero columns stay zero."""
    if (R[0] == R).all():
        return Z * (1.0 / math.sqrt(R[0]))
    gram = Z.transpose(0, 2, 1) @ (R[:, None] * Z)
    index = np.arange(Z.shape[2])
    diagonal = gram[:, index, index]
    gram[:, index, index] = np.where(diagonal == 0.0, 1.0, diagonal)
    return Z @ np.linalg.inv(np.linalg.cholesky(gram)).transpose(0, 2, 1)


def _without_rows(quadratic: _Quadratic) -> Point | None:
    """The optimum without any bound; None if the KKT conditions do not hold to the tolerance."""
    G, residual, pull = quadratic.G, quadratic.residual, quadratic.pull
    tall, wide = G.shape
    if tall < wide:
        # (I + ĜᵀĜ)⁻¹Ĝᵀ = Ĝᵀ(I + ĜĜᵀ)⁻¹ keeps the large residual out of any difference of large numbers.
        S = G @ G.T
        S.flat[:: tall + 1] += 1.0
        y = -G.T @ dposv(S, residual - G @ pull)[1] - pull
    else:
        H = G.T @ G
        H.flat[:: wide + 1] += 1.0
        y = dposv(H, -(pull + G.T @ residual))[1]
    error = residual + G @ y
    slope = G.T @ error
    # ‖H‖ ≤ 1 + ‖Ĝ‖²_F.
    scale = max(1.0, (1.0 + float(np.vdot(G, G))) * _norm(y), _norm(pull) + _norm(slope))
    kkt = float(np.abs(y + pull + slope).max()) / scale
    return Point(quadratic.increments(y), NO_ROWS, kkt, "optimal", error) if kkt <= KKT_TOLERANCE else None


def _violated(rows: Rows, U: Array) -> Mask | None:
    """Mask (r, n) of the rows that U violates, None if there are none."""
    value = rows.L @ U
    above, below = value - rows.upper, rows.lower - value
    if float(above.max()) <= _TOLERANCE and float(below.max()) <= _TOLERANCE:
        return None
    return (above > _TOLERANCE) | (below > _TOLERANCE)


def _norm(x: Array) -> float:
    return math.sqrt(float(np.vdot(x, x)))


def _with_rows(quadratic: _Quadratic, rows: Rows, mask: Mask, solver: Solver) -> Point | None:
    """The QP with the masked rows, and with more of them until no row is violated."""
    G, U_above = quadratic.G, quadratic.U_above
    H = G.T @ G
    H.flat[:: len(H) + 1] += 1.0
    f = quadratic.pull + G.T @ quadratic.residual
    qp_us = 0.0
    while True:
        row, joint = np.nonzero(mask)
        A = quadratic.row_matrix(rows, row, joint)
        lower, upper = rows.lower[row, joint], rows.upper[row, joint]
        if U_above is not None:
            # U_{i−1} meets the rows up to rounding; y = 0 must stay feasible exactly (Theorem 2).
            offset = np.einsum("ks,sk->k", rows.L[row], U_above[:, joint])
            lower, upper = np.minimum(lower - offset, 0.0), np.maximum(upper - offset, 0.0)
        solution = solve_qp(H, f, A, lower, upper, solver)
        if not solution.solved and U_above is not None:
            # Many rows without any room at y = 0 look contradictory to DAQP; a little room tells them apart.
            qp_us += solution.time_us
            lower, upper = np.minimum(lower, -_TOLERANCE), np.maximum(upper, _TOLERANCE)
            solution = solve_qp(H, f, A, lower, upper, solver)
        qp_us += solution.time_us
        if not solution.solved:
            return None
        U = quadratic.increments(solution.x)
        violated = _violated(rows, U)
        if violated is None or not (fresh := violated & ~mask).any():
            break
        mask = mask | fresh
    value = A @ solution.x
    gap = np.where(solution.multipliers > 0, upper - value, value - lower)
    active = np.abs(solution.multipliers) > _TOLERANCE
    found = ActiveRows(row[active], joint[active], solution.multipliers[active], gap[active])
    error = quadratic.residual + G @ solution.x
    return Point(U, found, solution.kkt_residual, solution.status, error, qp_us)

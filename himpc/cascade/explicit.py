"""The explicit route: every bound a row of a QP for a general solver; the compiled route's second opinion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import ActiveRows, LevelProblem, Point
from himpc.cascade.polish import polished
from himpc.cascade.white import WhiteLevel, white
from himpc.limits.rows import Rows
from himpc.qp import KKT_TOLERANCE, QPSolution, Solver, solve_qp

Array = NDArray[np.float64]

_BINDING = 1e-9
"""N·m: a row closer than this to its bound is binding."""
_NOISE = 1e-11
"""A row of which no larger share is left by (33) is rounding noise: its joint is not free any more."""
_ROOM = 1e-8
"""N·m: where U_{i−1} is all but the only point that the rows admit, solvers take rounding for a contradiction."""
_ACCURATE = 1e-9
"""Points that miss their optimality conditions by more are polished."""


def solve_explicit(
    problem: LevelProblem,
    rows: Rows,
    U_above: Array,
    above: Sequence[tuple[Array, Array]],
    Z: Array,
    solver: Solver,
    iterations: int | None = None,
) -> Point | None:
    """Problem i over all N·n increments, (32) or (34), with every bound handed to the solver.

    The QP is stated in the level's white coordinates, see `white`: its Hessian is the identity however far
    weights and inertias are apart, (33) holds for all of them, and rows have length one. A point whose
    residual is not all but nothing is solved for once more from the rows that it says bind, see `polished`.
    Knots beyond the level's own horizon keep the increments of the level above.

    Args:
        problem: the level's data.
        rows: all bounds.
        U_above: U_{i−1}, (N, n).
        above: (B_p, U_p) of every level above.
        Z: orthonormal bases of what (33) leaves free, (N, n, d).
        solver: which solver.
        iterations: that one attempt may take, see `solve_qp`; None: as many as it likes.

    Returns:
        the optimum, or None if no solver gave a point that is within `KKT_TOLERANCE` of its optimality
        conditions: in N·m for every increment, or as a share of it where it is larger than 1 N·m.
    """
    N, n = U_above.shape
    level = white(problem, U_above, Z)
    at = (rows.L @ U_above).ravel()
    lower, upper = rows.lower.ravel(), rows.upper.ravel()
    if above:
        # U_{i−1} meets the bounds up to rounding; it must stay feasible exactly (Theorem 2).
        lower, upper = np.minimum(lower, at), np.maximum(upper, at)
    every = _every_joint(rows.L.tobytes(), rows.L.shape, n)[:, : problem.knots * n]
    A = every @ level.P
    length = np.sqrt(np.einsum("ij,ij->i", A, A))
    reach = every @ np.tile(1.0 / np.sqrt(problem.R), problem.knots)
    kept = np.flatnonzero((length > _NOISE * reach) & (np.isfinite(lower) | np.isfinite(upper)))
    length = length[kept]
    A, low, high = A[kept] / length[:, None], (lower - at)[kept] / length, (upper - at)[kept] / length
    spent = 0.0
    for room in (0.0, _ROOM):
        given = level.c, A, low - room / length, high + room / length
        solution = solve_qp(np.eye(level.c.size), *given, solver, iterations)
        spent += solution.time_us
        solution = _judged(solution, level, A, low, high, length, U_above)
        if solution.kkt_residual > _ACCURATE:
            better = polished(solution, level.c, A, low, high)
            if better is not None:
                better = _judged(better, level, A, low, high, length, U_above)
                solution = better if better.kkt_residual < solution.kkt_residual else solution
        if solution.solved:
            U = U_above.copy()
            U[: problem.knots] += (level.P @ solution.x).reshape(problem.knots, n)
            multipliers = np.zeros(at.size)
            multipliers[kept] = solution.multipliers / length
            return _point(replace(solution, time_us=spent), U, multipliers, rows, lower, upper)
    return None


def _judged(
    solution: QPSolution, level: WhiteLevel, A: Array, low: Array, high: Array, length: Array, U_above: Array
) -> QPSolution:
    """The solution with the residual that counts: how far a gradient that is left moves each increment, as a
    share of 1 N·m or of the increment; how far rows are beyond their bounds, N·m; and the gaps, N·m, of
    bounds that press."""
    x, multipliers = solution.x, solution.multipliers
    with np.errstate(all="ignore"):  # a point that was given up may be anything
        gradient = x + level.c + A.T @ multipliers
        size = np.maximum(1.0, np.abs(U_above.ravel()[: len(level.P)] + level.P @ x))
        missing = float((np.abs(level.P) @ np.abs(gradient) / size).max(initial=0.0))
        value = A @ x
        outside = float((np.maximum(low - value, value - high) * length).max(initial=0.0))
        pressing = np.abs(multipliers) > _BINDING * (1.0 + np.abs(multipliers).max(initial=0.0))
        gap = np.where(multipliers > 0, high - value, value - low) * length
        apart = float(np.abs(gap[pressing]).max(initial=0.0))
        residual = max(missing, outside, apart)
    return replace(solution, kkt_residual=residual if residual >= 0 else float("inf"))


def quadratic(problem: LevelProblem, n: int) -> tuple[Array, Array]:
    """H (N·n, N·n) and f (N·n,) of a level: its cost is UᵀHU + 2fᵀU and a constant."""
    N, m, K = len(problem.B), problem.B.shape[1], problem.knots
    G = (problem.C[..., None] * problem.B.transpose(1, 0, 2)).reshape(N, m, N * n)[:K].reshape(K * m, N * n)
    weighted = G * np.tile(problem.root_Q**2, K)[:, None]
    return G.T @ weighted + np.diag(np.tile(problem.R, N)), weighted.T @ problem.free[:K].ravel()


@lru_cache(maxsize=8)
def _every_joint(L: bytes, shape: tuple[int, int], n: int) -> Array:
    return np.asarray(np.kron(np.frombuffer(L).reshape(shape), np.eye(n)), np.float64)


def _point(
    solution: QPSolution, U: Array, multipliers: Array, rows: Rows, lower: Array, upper: Array
) -> Point:
    value = (rows.L @ U).ravel()
    slack = np.where(multipliers > 0, upper - value, value - lower)
    # An interior-point-like solver leaves tiny multipliers everywhere: binding means both.
    active = np.flatnonzero((np.abs(multipliers) > _BINDING) & (slack < 1e3 * _BINDING))
    row, joint = np.divmod(active, U.shape[1])
    return Point(
        U,
        ActiveRows(row, joint, multipliers[active], slack[active]),
        solution.kkt_residual,
        solution.status,
        qp_us=solution.time_us,
    )

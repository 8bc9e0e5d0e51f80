"""The explicit route: every bound is a row of a QP for a general solver. It serves to check the compiled
route."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import ActiveRows, LevelProblem, Point
from himpc.cascade.polish import descended, polished
from himpc.cascade.white import WhiteLevel, white
from himpc.limits.rows import Rows
from himpc.qp import KKT_TOLERANCE, QPSolution, Solver, solve_qp

Array = NDArray[np.float64]

_BINDING = 1e-9
"""A row is active if two conditions hold: its multiplier exceeds _BINDING, and its distance from its bound is
below 1000 · _BINDING, N·m."""
_NOISE = 1e-11
"""If the projection of a row on the free directions of (33) is below this share of the row, the projection is
rounding noise, and the row's joint is no longer free."""
_ROOM = 1e-9
"""N·m by which bounds are widened for a last attempt. The optimum is then computed from the active rows of
this attempt with their exact bounds."""
_ACCURATE = 1e-9
"""Points with a larger residual of their optimality conditions are refined."""


def solve_explicit(
    problem: LevelProblem,
    rows: Rows,
    U_above: Array,
    above: Sequence[tuple[Array, Array]],
    Z: Array,
    solver: Solver,
    iterations: int | None = None,
) -> Point | None:
    """Solves Problem i, (32) or (34), over all N·n increments, with every bound as a row of the QP.

    The QP is stated in the level's white coordinates, see `white`. In them the Hessian is the identity for
    all weights and inertias, every point satisfies (33), and rows have length one. If the residual of the
    solver's point is larger than rounding, the point is refined from its active rows, see `polished`. Knots
    beyond the level's own horizon keep the increments of the level above.

    Args:
        problem: the level's data.
        rows: all bounds.
        U_above: U_{i−1}, (N, n).
        above: (B_p, U_p) of every level above.
        Z: orthonormal bases of the directions that (33) leaves free, (N, n, d).
        solver: name of the QP solver.
        iterations: largest number of iterations of one attempt, see `solve_qp`; None: no limit.

    Returns:
        the optimum. None if a violated row does not depend on the free directions, or if no point satisfies
        its optimality conditions to `KKT_TOLERANCE`. This tolerance is in N·m for increments up to 1 N·m, and
        a share of larger increments.
    """
    n = U_above.shape[1]
    level = white(problem, U_above, [B for B, _ in above], Z)
    at = rows.values(U_above).ravel()
    lower, upper = rows.lower.ravel(), rows.upper.ravel()
    if above:
        # U_{i−1} meets the bounds up to rounding; it must stay feasible exactly (Theorem 2).
        lower, upper = np.minimum(lower, at), np.maximum(upper, at)
    every = every_row(rows, n)[:, : problem.knots * n]
    A = every @ level.P
    length = np.sqrt(np.einsum("ij,ij->i", A, A))
    reach = every @ np.tile(1.0 / np.sqrt(problem.R), problem.knots)
    kept = np.flatnonzero((length > _NOISE * reach) & (np.isfinite(lower) | np.isfinite(upper)))
    if (np.delete(np.maximum(lower - at, at - upper), kept) > KKT_TOLERANCE).any():
        return None  # such a row does not depend on the free directions
    length = length[kept]
    A, low, high = A[kept] / length[:, None], (lower - at)[kept] / length, (upper - at)[kept] / length
    found = solve_qp(np.eye(level.c.size), level.c, A, low, high, solver, iterations)

    def judged(one: QPSolution) -> QPSolution:
        return _judged(one, level, A, low, high, length, U_above)

    best = judged(found)
    for again in (polished, descended if iterations is None else None):
        if again is not None and best.kkt_residual > _ACCURATE:
            better = again(best, level.c, A, low, high)
            best = best if better is None else min(best, judged(better), key=lambda one: one.kkt_residual)
    if not best.solved and iterations is None:
        room = _ROOM / length
        wider = judged(solve_qp(np.eye(level.c.size), level.c, A, low - room, high + room, solver))
        better = polished(wider, level.c, A, low, high)
        best = wider if better is None else judged(better)
    if not best.solved:
        return None
    U = U_above.copy()
    U[: problem.knots] += (level.P @ best.x).reshape(problem.knots, n)
    multipliers = np.zeros(at.size)
    multipliers[kept] = best.multipliers / length
    return _point(best, U, multipliers, rows, lower, upper)


def _judged(
    solution: QPSolution, level: WhiteLevel, A: Array, low: Array, high: Array, length: Array, U_above: Array
) -> QPSolution:
    """Returns the solution with its residual. The residual is the larger of two numbers: the violation of the
    rows in N·m, and the largest change of an increment by a Newton step on the active rows. The change is
    divided by 1 N·m or by the increment, whichever is larger."""
    x, multipliers = solution.x, solution.multipliers
    if not (np.isfinite(x).all() and np.isfinite(multipliers).all()):
        return replace(solution, kkt_residual=float("inf"))
    gradient, value = x + level.c + A.T @ multipliers, A @ x
    held = multipliers != 0.0
    missing = np.where(multipliers > 0, high, low)[held] - value[held]
    # The part of the gradient along the active rows only changes their multipliers.
    step = np.linalg.lstsq(A[held], missing + A[held] @ gradient)[0] - gradient
    size = np.maximum(1.0, np.abs(U_above.ravel()[: len(level.P)] + level.P @ x))
    moved = float((np.abs(level.P @ step) / size).max(initial=0.0))
    outside = float((np.maximum(low - value, value - high) * length).max(initial=0.0))
    residual = max(moved, outside)
    return replace(solution, kkt_residual=residual if residual >= 0 else float("inf"))


def quadratic(problem: LevelProblem, n: int) -> tuple[Array, Array]:
    """Returns H (N·n, N·n) and f (N·n,) of a level, whose cost is UᵀHU + 2fᵀU plus a constant."""
    N, m, K = len(problem.B), problem.B.shape[1], problem.knots
    G = (problem.C[..., None] * problem.B.transpose(1, 0, 2)).reshape(N, m, N * n)[:K].reshape(K * m, N * n)
    weighted = G * np.tile(problem.root_Q**2, K)[:, None]
    return G.T @ weighted + np.diag(np.tile(problem.R, N)), weighted.T @ problem.free[:K].ravel()


def every_row(rows: Rows, n: int) -> Array:
    """Returns the rows as one matrix (r·n, N·n) for the increments, which are ordered by knot, then by
    joint."""
    A = _every_joint(rows.L.tobytes(), rows.L.shape, n)
    N = rows.L.shape[1]
    if rows.directions:
        A = A.copy()
        for place, directions in enumerate(rows.directions):
            if directions is not None:
                block = slice(place * N, (place + 1) * N)
                A[block.start * n : block.stop * n] = np.kron(rows.L[block], directions.D)
    return A


@lru_cache(maxsize=8)
def _every_joint(L: bytes, shape: tuple[int, int], n: int) -> Array:
    return np.asarray(np.kron(np.frombuffer(L).reshape(shape), np.eye(n)), np.float64)


def _point(
    solution: QPSolution, U: Array, multipliers: Array, rows: Rows, lower: Array, upper: Array
) -> Point:
    value = rows.values(U).ravel()
    slack = np.where(multipliers > 0, upper - value, value - lower)
    # Some solvers leave tiny multipliers at all rows. A row counts as active only if it is also near its
    # bound.
    active = np.flatnonzero((np.abs(multipliers) > _BINDING) & (slack < 1e3 * _BINDING))
    row, joint = np.divmod(active, U.shape[1])
    return Point(
        U,
        ActiveRows(row, joint, multipliers[active], slack[active]),
        solution.kkt_residual,
        solution.status,
        qp_us=solution.time_us,
    )

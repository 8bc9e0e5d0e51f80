"""The explicit route: all rows and the equality constraints (33) as printed; the compiled one's oracle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import ActiveRows, LevelProblem, Point
from himpc.limits.rows import Rows
from himpc.qp import QPSolution, Solver, solve_qp

Array = NDArray[np.float64]

_BINDING = 1e-9
"""N·m: a row closer than this to its bound is binding."""
_ALONG = 1e-6
"""A row of which this share lies in what RANK_TOLERANCE leaves to lower levels is rounding noise."""
_ON_SUBSPACE = 1e-7
"""N·m: how far a point may lie from the subspace that (33) leaves."""


def solve_explicit(
    problem: LevelProblem,
    rows: Rows,
    U_above: Array,
    above: Sequence[tuple[Array, Array]],
    Z: Array,
    solver: Solver,
    iterations: int | None = None,
) -> Point | None:
    """Problem i over all N·n increments with every bound and every equality (33) handed to the solver.

    Near a singularity the printed equality rows are dependent: active-set solvers may refuse them, and a
    point that meets them to the tolerance may be far from their subspace. Next to it a row may be nothing but
    rounding: level 1 of the straight planar arm feels one direction by 6e-12 of the other, which as a row of
    its own would take that direction from level 2 for no reason (and moved the torque by 2.6 N·m). In both
    cases the subspace that RANK_TOLERANCE leaves is described by orthonormal rows. Knots beyond the level's
    own horizon keep the increments of the level above.

    Args:
        problem: the level's data.
        rows: all bounds.
        U_above: U_{i−1}, (N, n).
        above: (B_p, U_p) of every level above.
        Z: orthonormal bases of what (33) leaves free, (N, n, d).
        solver: which solver.
        iterations: that one attempt may take, see `solve_qp`; None: as many as it likes.

    Returns:
        the optimum, or None if the solver gave no point within the KKT tolerance.
    """
    N, n = U_above.shape
    H, f = quadratic(problem, n)
    bounds = _every_joint(rows.L.tobytes(), rows.L.shape, n)
    lower, upper = rows.lower.ravel(), rows.upper.ravel()
    if above:
        # U_{i−1} meets the bounds up to rounding; it must stay feasible exactly (Theorem 2).
        at = bounds @ U_above.ravel()
        lower, upper = np.minimum(lower, at), np.maximum(upper, at)
    tail = np.eye(N * n)[problem.knots * n :]
    for equalities in _equalities(above, U_above, Z):
        E = np.vstack([equalities, tail])
        target = E @ U_above.ravel()
        A, low, high = np.vstack([bounds, E]), np.r_[lower, target], np.r_[upper, target]
        solution = solve_qp(H, f, A, low, high, solver, iterations)
        if solution.solved and _off_subspace(solution.x.reshape(N, n) - U_above, Z) <= _ON_SUBSPACE:
            return _point(solution, rows, lower, upper, bounds, (N, n))
    return None


def _off_subspace(change: Array, Z: Array) -> float:
    """How far a change of the increments leaves span Z at any knot, N·m."""
    column = change[:, :, None]
    return float(np.abs(column - Z @ (Z.transpose(0, 2, 1) @ column)).max())


def quadratic(problem: LevelProblem, n: int) -> tuple[Array, Array]:
    """H (N·n, N·n) and f (N·n,) of a level: its cost is UᵀHU + 2fᵀU and a constant."""
    N, m, K = len(problem.B), problem.B.shape[1], problem.knots
    G = (problem.C[..., None] * problem.B.transpose(1, 0, 2)).reshape(N, m, N * n)[:K].reshape(K * m, N * n)
    weighted = G * np.tile(problem.root_Q**2, K)[:, None]
    return G.T @ weighted + np.diag(np.tile(problem.R, N)), weighted.T @ problem.free[:K].ravel()


@lru_cache(maxsize=8)
def _every_joint(L: bytes, shape: tuple[int, int], n: int) -> Array:
    return np.asarray(np.kron(np.frombuffer(L).reshape(shape), np.eye(n)), np.float64)


def _equalities(above: Sequence[tuple[Array, Array]], U_above: Array, Z: Array) -> Iterator[Array]:
    """(33) as printed unless rows of it are noise; then, or if that is refused, by orthonormal rows."""
    N, n = U_above.shape
    if not above:
        yield np.empty((0, N * n))
        return
    if not any(_binds(B, Z) for B, _ in above):
        yield np.vstack([_block_diagonal(B) for B, _ in above])
    fixed = []
    for j in range(N):
        left, singular, _ = np.linalg.svd(np.eye(n) - Z[j] @ Z[j].T)
        fixed.append(left[:, singular > 0.5].T)
    rows = np.zeros((sum(len(block) for block in fixed), N * n))
    start = 0
    for j, block in enumerate(fixed):
        rows[start : start + len(block), j * n : (j + 1) * n] = block
        start += len(block)
    yield rows


def _binds(B: Array, Z: Array) -> bool:
    """Whether a row, however short, points along what is left to lower levels."""
    length = np.sqrt((B * B).sum(axis=2, keepdims=True))
    return bool((np.abs(B @ Z) > _ALONG * length).any())


def _block_diagonal(B: Array) -> Array:
    N, m, n = B.shape
    blocks = np.zeros((N, m, N, n))
    index = np.arange(N)
    blocks[index, :, index] = B
    return blocks.reshape(N * m, N * n)


def _point(
    solution: QPSolution, rows: Rows, lower: Array, upper: Array, bounds: Array, shape: tuple[int, int]
) -> Point:
    count = bounds.shape[0]
    multipliers = solution.multipliers[:count]
    value = bounds @ solution.x
    slack = np.where(multipliers > 0, upper - value, value - lower)
    # An interior-point-like solver leaves tiny multipliers everywhere: binding means both.
    active = np.flatnonzero((np.abs(multipliers) > _BINDING) & (slack < 1e3 * _BINDING))
    row, joint = np.divmod(active, shape[1])
    return Point(
        solution.x.reshape(shape),
        ActiveRows(row, joint, multipliers[active], slack[active]),
        solution.kkt_residual,
        solution.status,
        qp_us=solution.time_us,
    )

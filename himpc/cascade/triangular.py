"""The fast route: all levels from one triangular factorisation per knot, while no bound changes hands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import accumulate
from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgeqrf, dorgqr, dposv  # pyright: ignore[reportAttributeAccessIssue]

from himpc.cascade.level import NO_ROWS, ActiveRows, LevelProblem, Point
from himpc.cascade.null_space import CLEARLY_REGULAR
from himpc.limits.rows import Rows
from himpc.qp import KKT_TOLERANCE

Array = NDArray[np.float64]

_TOLERANCE = 1e-9
"""N·m: a row violated by less counts as met."""
_ACCURACY = 1e-8
"""N·m: how far a point may be from the optimum; normal equations can lose more, the other routes do not."""
_WORK = 64
"""LAPACK's work space, enough for any small matrix; without it each call asks first."""


def solve_triangular(
    problems: Sequence[LevelProblem], B: Array, rows: Rows, warm: Sequence[ActiveRows]
) -> list[Point]:
    """The leading levels whose optimum has the same active rows as a tick ago.

    One Householder QR per knot, [B_1ᵀ … B_rᵀ] = Q T, gives coordinates U_j = Q_j y_j in which the cascade is
    triangular: B_i sees the first m_1 + … + m_i of them only, (33) freezes those of the levels above, and
    ‖U‖² = ‖y‖². Each level then solves for its own coordinates; the rest of its freedom stays at zero but for
    what active rows, taken as equalities, push into it. A level's point is kept if the KKT conditions hold:
    gradient, signs of the multipliers, no other row violated. The first level that fails ends the list.

    Args:
        problems: the levels, highest priority first.
        B: B_p of all levels but the last, one below the other, (N, m_1 + … + m_{r−1}, n).
        rows: all bounds.
        warm: rows to take as active, per level.

    Returns:
        verified optima of the first levels; none if a level has different weights R per joint or a horizon of
        its own, or whose Jacobians are close to singular at some knot.
    """
    started = perf_counter_ns()
    N, _, n = problems[0].B.shape
    if any(problem.common_R is None or problem.knots < N for problem in problems):
        return []
    ends, whole = _columns(tuple(problem.B.shape[1] for problem in problems), n)
    if not ends:
        Q = T = _identity(N, n)
    else:
        if whole:
            B = np.concatenate([problem.B for problem in problems], axis=1)
        elif B.shape[1] > ends[-1]:
            B = B[:, : ends[-1]]
        Q, T = _factorised(B)
        pivots = np.abs(T.diagonal(axis1=1, axis2=2))
        if not float(pivots.min()) > CLEARLY_REGULAR * float(pivots.max()):
            return []

    last = len(problems) - 1
    y = np.zeros((last + 1, N, n))
    points: list[tuple[Array, ActiveRows, float, str, float]] = []
    start = 0
    for place, problem in enumerate(problems):
        if place:
            y[place, :, :start] = y[place - 1, :, :start]
        if place < len(ends):
            end = ends[place]
            seen = T[:, :end, start:end].transpose(2, 0, 1)
        elif start == n or place == last:
            end = n
            seen = (problem.B @ Q).transpose(1, 0, 2)
        else:
            break  # whether this level leaves anything free takes a rank
        found = _level(problem, seen, y[place], start, end, Q, rows, warm[place])
        if found is None:
            break
        now = perf_counter_ns()
        points.append((*found, "optimal" if end > start else "empty", (now - started) / 1e3))
        started, start = now, end
    return _within(points, Q, y, rows) if points else []


@lru_cache(maxsize=64)
def _columns(sizes: tuple[int, ...], n: int) -> tuple[list[int], bool]:
    """Where the own columns end of the levels that are factorised, and whether the last level is one of them.

    The last level is left out where it reaches all that is left: nobody below needs what it leaves.
    """
    ends = [end for end in accumulate(sizes) if end <= n]
    whole = len(ends) == len(sizes)
    if whole and sum(sizes) == n:
        return ends[:-1], False
    return ends, whole


@lru_cache(maxsize=64)
def _identity(N: int, n: int) -> Array:
    return np.tile(np.eye(n), (N, 1, 1))


def _factorised(B: Array) -> tuple[Array, Array]:
    """Q (N, n, n) and T (N, n, s), upper triangular, of the QR factorisation of each B_jᵀ."""
    # LAPACK knot by knot: NumPy's batched qr costs twice as much for a handful of small matrices.
    N, s, n = B.shape
    Q, T = np.empty((N, n, n)), np.empty((N, n, s))
    for j in range(N):
        factors, scales, _, _ = dgeqrf(B[j].T, lwork=_WORK)
        T[j] = Q[j, :, :s] = factors
        Q[j] = dorgqr(Q[j], scales, lwork=_WORK)[0]
    T *= _upper(n, s)
    return Q, T


@lru_cache(maxsize=64)
def _upper(n: int, s: int) -> Array:
    return np.triu(np.ones((n, s)))


def _level(
    problem: LevelProblem,
    seen: Array,
    y: Array,
    start: int,
    end: int,
    Q: Array,
    rows: Rows,
    active: ActiveRows,
) -> tuple[Array, ActiveRows, float] | None:
    """Solves for coordinates start … n of one level and writes them into y, (N, n).

    Args:
        problem: the level.
        seen: its rows in the new coordinates, (m, N, end): B Q without columns that are zero.
        y: coordinates of the levels above in columns up to `start`, zero beyond.
        start, end: its own columns.
        Q: (N, n, n).
        rows: all bounds.
        active: rows to take as equalities.

    Returns:
        Q^½ e, the active rows with their multipliers, and the norm of the gradient; None if the active rows
        do not hold an optimum, or not an accurate one.
    """
    N, m, _ = problem.B.shape
    R = problem.common_R or 0.0
    own = end - start
    effect = (problem.weighted_C[..., None] * seen).reshape(N * m, N, end)
    error = problem.weighted_free.flatten()
    if start:
        error += effect.reshape(N * m, N * end) @ y[:, :end].reshape(-1)
    if own == 0:
        return error, NO_ROWS, 0.0
    G = (effect[:, :, start:] if start else effect).reshape(N * m, N * own)
    H = G.T @ G
    H.reshape(-1)[:: N * own + 1] += R
    if len(active):
        found = _on_rows(H, G.T @ error, R, y, start, own, Q, rows, active)
        if found is None:
            return None
        solved, push, active = found
        gradient = R * solved + push
    else:
        solved = dposv(H, G.T @ -error, overwrite_a=1, overwrite_b=1)[1]
        gradient = R * solved
    y[:, start:end] = solved.reshape(N, own)
    error += G @ solved
    gradient += G.T @ error
    kkt = math.sqrt(gradient @ gradient)
    # H ≥ R: the optimum is at most ‖gradient‖/R away.
    return (error, active, kkt) if kkt <= min(_ACCURACY * R, KKT_TOLERANCE) else None


def _on_rows(
    H: Array,
    slope: Array,
    R: float,
    y: Array,
    start: int,
    own: int,
    Q: Array,
    rows: Rows,
    active: ActiveRows,
) -> tuple[Array, Array, ActiveRows] | None:
    """The own coordinates with some rows as equalities; the coordinates beyond are written into y.

    Returns:
        own coordinates, the rows' share of the gradient, and the rows with their multipliers; None if
        the rows are dependent or a multiplier has lost its sign.
    """
    N = len(y)
    row, joint, count = active.row, active.joint, active.row.size
    L = rows.L[row]
    A = L[:, :, None] * Q[:, joint, start:].transpose(1, 0, 2)
    A_own, A_rest = A[:, :, :own].reshape(count, -1), A[:, :, own:].reshape(count, -1)
    target = np.where(active.multiplier > 0.0, rows.upper[row, joint], rows.lower[row, joint])
    if start:
        above = np.matmul(Q[:, :, :start], y[:, :start, None])[:, :, 0]
        target -= (L * above.T[joint]).sum(axis=1)
    right = np.empty((1 + count, N * own))
    right[0], right[1:] = slope, A_own
    across = dposv(H, right.T, overwrite_a=1, overwrite_b=1)[1].T
    solved, pulled = -across[0], across[1:]
    schur = A_own @ pulled.T
    if A_rest.size:
        schur += A_rest @ (A_rest.T / R)
    _, multipliers, info = dposv(schur, A_own @ solved - target)
    if info != 0 or not float((multipliers * active.multiplier).min()) > 0.0:
        return None
    solved -= multipliers @ pulled
    missed = A_own @ solved - target
    if A_rest.size:
        rest = multipliers @ A_rest / -R
        y[:, start + own :] = rest.reshape(N, -1)
        missed += A_rest @ rest
    if not float(missed @ missed) < _TOLERANCE**2:
        return None
    return solved, multipliers @ A_own, ActiveRows(row, joint, multipliers, missed)


def _within(
    points: Sequence[tuple[Array, ActiveRows, float, str, float]], Q: Array, y: Array, rows: Rows
) -> list[Point]:
    """The points up to the first whose increments Q y violate a row."""
    good = len(points)
    U = np.matmul(Q, y[:good, :, :, None])[..., 0]
    value = rows.L @ U
    room = np.minimum(rows.upper - value, value - rows.lower)
    if not float(room.min()) >= -_TOLERANCE:
        # A comparison with NaN is false, so what is not a number is no point either.
        met = room.reshape(good, -1).min(axis=1) >= -_TOLERANCE
        good = good if met.all() else int(met.argmin())
    return [
        Point(U[place], active, kkt, status, error, time_us=time_us)
        for place, (error, active, kkt, status, time_us) in enumerate(points[:good])
    ]

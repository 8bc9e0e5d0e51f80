"""The fast route: all levels from one triangular factorisation per knot, while no bound changes hands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import accumulate
from time import perf_counter_ns
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgeqrf, dorgqr, dposv, dpotrs  # pyright: ignore[reportAttributeAccessIssue]

from himpc.cascade.level import NO_ROWS, ActiveRows, LevelProblem, Point
from himpc.cascade.null_space import CLEARLY_REGULAR
from himpc.limits.rows import Rows
from himpc.qp import KKT_TOLERANCE

Array = NDArray[np.float64]

_TOLERANCE = 1e-9
"""N·m: a row violated by less counts as met."""
_ACCURACY = 1e-8
"""N·m: how far a point may be from the optimum; normal equations can lose more, the other routes do not."""
_NOTHING = np.empty(0)
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
    bound = _bound(active, y, start, own, Q, rows) if len(active) else None
    if bound is None:
        factor, solved, _ = dposv(H, G.T @ -error, overwrite_b=1)
        gradient = R * solved
    else:
        right = np.empty((1 + active.row.size, N * own))
        right[0], right[1:] = G.T @ error, bound.A_own
        factor, across, _ = dposv(H, right.T, overwrite_b=1)
        solved = -across[:, 0]
        bound = bound.solve(across[:, 1:], solved, R)
        if bound is None:
            return None
        gradient = R * solved + bound.multipliers @ bound.A_own
    error += G @ solved
    gradient += G.T @ error
    tolerance = min(_ACCURACY * R, KKT_TOLERANCE)
    kkt = math.sqrt(gradient @ gradient)
    if not kkt <= tolerance:
        # The normal equations lose digits on long horizons; one step of refinement brings them back.
        change = -dpotrs(factor, gradient)[0]
        if bound is not None:
            bound = bound.refined(change, R)
        solved += change
        error += G @ change
        gradient = R * solved + G.T @ error
        if bound is not None:
            gradient += bound.multipliers @ bound.A_own
        kkt = math.sqrt(gradient @ gradient)
        if not kkt <= tolerance:
            return None
    y[:, start:end] = solved.reshape(N, own)
    if bound is None:
        return error, NO_ROWS, kkt
    missed = bound.missed(solved, bound.rest)
    if not (float((bound.multipliers * active.multiplier).min()) > 0.0 and missed @ missed < _TOLERANCE**2):
        return None
    y[:, end:] = bound.rest.reshape(N, -1)
    return error, ActiveRows(active.row, active.joint, bound.multipliers, missed), kkt


class _Bound(NamedTuple):
    """Rows taken as equalities: A_own y_own + A_rest y_rest = target, (k, ·), and what they ask for.

    Attributes:
        pulled: H⁻¹ A_ownᵀ.
        schur: Cholesky factor of A_own H⁻¹ A_ownᵀ + A_rest A_restᵀ/R.
        multipliers: (k,).
        rest: the coordinates beyond the level's own.
        lost: what the equalities are still missed by.
    """

    A_own: Array
    A_rest: Array
    target: Array
    pulled: Array
    schur: Array
    multipliers: Array
    rest: Array
    lost: Array

    def missed(self, own: Array, rest: Array) -> Array:
        """By how much the equalities are missed, (k,)."""
        missed = self.A_own @ own - self.target
        return missed + self.A_rest @ rest if rest.size else missed

    def solve(self, pulled: Array, own: Array, R: float) -> _Bound | None:
        """Moves `own`, the optimum without rows, onto them; None if they are dependent."""
        S = self.A_own @ pulled
        if self.A_rest.size:
            S += self.A_rest @ (self.A_rest.T / R)
        schur, multipliers, info = dposv(S, self.A_own @ own - self.target)
        if info != 0:
            return None
        own -= pulled @ multipliers
        rest = multipliers @ self.A_rest / -R
        return self._replace(
            pulled=pulled, schur=schur, multipliers=multipliers, rest=rest, lost=self.missed(own, rest)
        )

    def refined(self, change: Array, R: float) -> _Bound:
        """The same after `change` of the own coordinates, which is corrected so that the rows are met."""
        more = dpotrs(self.schur, self.A_own @ change + self.lost)[0]
        change -= self.pulled @ more
        multipliers = self.multipliers + more
        return self._replace(multipliers=multipliers, rest=multipliers @ self.A_rest / -R)


def _bound(active: ActiveRows, y: Array, start: int, own: int, Q: Array, rows: Rows) -> _Bound:
    """The rows in the coordinates that a level may change."""
    row, joint, count = active.row, active.joint, active.row.size
    L = rows.L[row]
    A = L[:, :, None] * Q[:, joint, start:].transpose(1, 0, 2)
    target = np.where(active.multiplier > 0.0, rows.upper[row, joint], rows.lower[row, joint])
    if start:
        above = np.matmul(Q[:, :, :start], y[:, :start, None])[:, :, 0]
        target -= (L * above.T[joint]).sum(axis=1)
    A_own, A_rest = A[:, :, :own].reshape(count, -1), A[:, :, own:].reshape(count, -1)
    return _Bound(A_own, A_rest, target, *(_NOTHING,) * 5)


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

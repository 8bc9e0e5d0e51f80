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
from scipy.linalg.lapack import dgeqrf, dgesv, dgetrs, dorgqr, dposv, dpotrs  # pyright: ignore[reportAttributeAccessIssue]

from himpc.cascade.level import NO_ROWS, ActiveRows, LevelProblem, Point
from himpc.cascade.null_space import CLEARLY_REGULAR
from himpc.limits.rows import Rows
from himpc.qp import KKT_TOLERANCE

Array = NDArray[np.float64]

_TOLERANCE = 1e-9
"""N·m: a row violated by less counts as met."""
_ACCURACY = 1e-8
"""N·m: how far a point may be from the optimum, since H ≥ R; the normal equations can lose more."""
_ROUNDING = 2e-15
"""A gradient below this share of ‖G‖‖e‖ is rounding: no better point can be told from this one."""
_ROUNDS = 2
"""The normal equations lose digits on long horizons; one step of refinement brings them back."""
_PASSES = 3
"""How often the levels are solved while rows are added; then a QP solver sorts them out."""
_WORK = 64
"""LAPACK's work space, enough for any small matrix; without it each call asks first."""


_Solved = tuple[Array, ActiveRows, float, str, float]
"""Q^½ e, active rows, KKT residual, status and microseconds of a level."""


def solve_triangular(
    problems: Sequence[LevelProblem], B: Array, rows: Rows, warm: Sequence[ActiveRows]
) -> list[Point]:
    """The leading levels whose optimum has the same active rows as a tick ago, or nearly so.

    One Householder QR per knot, [B_1ᵀ … B_rᵀ] = Q T, gives coordinates U_j = Q_j y_j in which the cascade is
    triangular: B_i sees the first m_1 + … + m_i of them only, (33) freezes those of the levels above, and
    ‖U‖² = ‖y‖². Each level then solves for its own coordinates; the rest of its freedom stays at zero but for
    what active rows, taken as equalities, push into it. A level's point is kept if the KKT conditions hold:
    gradient, signs of the multipliers, no other row violated. Rows whose multiplier has lost its sign are let
    go, violated ones are added, a few times; the first level that still fails ends the list.

    Small products are written `a.dot(b)`: for these sizes that takes half the time of `a @ b`.

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
    spans, factors, whole = _columns(tuple(problem.B.shape[1] for problem in problems), n)
    if not factors:
        Q = T = _identity(N, n)
    else:
        if whole:
            B = np.concatenate([problem.B for problem in problems], axis=1)
        elif B.shape[1] > spans[factors - 1][1]:
            B = B[:, : spans[factors - 1][1]]
        Q, T = _factorised(B)
        pivots = np.abs(T.diagonal(axis1=1, axis2=2))
        if not float(pivots.min()) > CLEARLY_REGULAR * float(pivots.max()):
            return []

    y = np.zeros((len(problems), N, n))
    taken = list(warm)
    points: list[_Solved] = []
    good: list[Point] = []
    for _ in range(_PASSES):
        del points[len(good) :]
        for place in range(len(good), len(spans)):
            problem, (start, end) = problems[place], spans[place]
            y[place] = 0.0
            if place:
                y[place, :, :start] = y[place - 1, :, :start]
            if place < factors:
                seen = T[:, :end, start:end].transpose(2, 0, 1)
            else:
                seen = (problem.B @ Q).transpose(1, 0, 2)
            found = _level(problem, seen, y[place], start, end, Q, rows, taken[place])
            if found is None:
                break
            now = perf_counter_ns()
            points.append((*found, "optimal" if end > start else "empty", (now - started) / 1e3))
            started = now
        good, wanted = _within(points, Q, y, rows)
        if wanted is None:
            break
        taken[len(good)] = wanted
    return good


@lru_cache(maxsize=64)
def _columns(sizes: tuple[int, ...], n: int) -> tuple[list[tuple[int, int]], int, bool]:
    """First and last own column of the levels, how many levels are factorised, and whether all of them are.

    The last level is left out where it reaches all that is left: nobody below needs what it leaves. A level
    that wants more than is left ends the list if others follow: what it leaves them takes a rank.
    """
    ends = [end for end in accumulate(sizes) if end <= n]
    factors = len(ends) - (sum(sizes) == n)
    spans: list[tuple[int, int]] = []
    for place in range(len(sizes)):
        start = spans[-1][1] if spans else 0
        if place >= len(ends) and start < n and place < len(sizes) - 1:
            break
        spans.append((start, ends[place] if place < len(ends) else n))
    return spans, factors, factors == len(sizes)


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
        problem, rows, Q: the level, all bounds, the bases (N, n, n).
        seen: its rows in the new coordinates, (m, N, end): B Q without columns that are zero.
        y: coordinates of the levels above in columns up to `start`, zero beyond.
        start, end: its own columns.
        active: rows to take as equalities.

    Returns:
        Q^½ e, the rows that hold the optimum, and the KKT residual; None if it was not found.
    """
    N, m, _ = problem.B.shape
    R = problem.common_R or 0.0
    own = end - start
    effect = (problem.weighted_C[..., None] * seen).reshape(N * m, N, end)
    error = problem.weighted_free.flatten()
    if start:
        error += effect.reshape(N * m, N * end).dot(y[:, :end].reshape(-1))
    if own == 0:
        return error, NO_ROWS, 0.0
    G = (effect[:, :, start:] if start else effect).reshape(N * m, N * own)
    H = G.T.dot(G)
    H.reshape(-1)[:: N * own + 1] += R
    while len(active):
        found = _bound_optimum(G, error, H, R, _equalities(active, y, start, own, Q, rows))
        if found is None:
            return None
        solved, multipliers, rest, after, gradient = found
        pressing = multipliers * active.multiplier
        if float(pressing.min()) > 0.0:
            y[:, start:end] = solved.reshape(N, own)
            y[:, end:] = rest.reshape(N, -1)
            return after, ActiveRows(active.row, active.joint, multipliers, pressing), gradient
        active = active.only(pressing > 0.0)
    found = _free_optimum(G, error, H, R)
    if found is None:
        return None
    solved, after, gradient = found
    y[:, start:end] = solved.reshape(N, own)
    return after, NO_ROWS, gradient


class _Equalities(NamedTuple):
    """A_own y_own + A_rest y_rest = target for k rows, in the coordinates that a level may change."""

    A_own: Array
    A_rest: Array
    target: Array


def _equalities(active: ActiveRows, y: Array, start: int, own: int, Q: Array, rows: Rows) -> _Equalities:
    row, joint, count = active.row, active.joint, active.row.size
    L = rows.L.take(row, 0)
    picked = Q.take(joint, 1).transpose(1, 0, 2)
    A = L[:, :, None] * picked[:, :, start:]
    place = row * Q.shape[1] + joint
    target = np.where(active.multiplier > 0.0, rows.upper.take(place), rows.lower.take(place))
    if start:
        above = L[:, :, None] * picked[:, :, :start]
        target -= above.reshape(count, -1).dot(y[:, :start].reshape(-1))
    return _Equalities(A[:, :, :own].reshape(count, -1), A[:, :, own:].reshape(count, -1), target)


def _accurate(slope: Array, G: Array, error: Array, own: Array, R: float) -> float | None:
    """The KKT residual if the gradient `slope` is small enough, or as small as rounding lets it be."""
    gradient = math.sqrt(slope.dot(slope))
    if gradient <= min(_ACCURACY * R, KKT_TOLERANCE):
        return gradient
    size = float(np.linalg.norm(G))
    if not gradient <= _ROUNDING * size * float(np.linalg.norm(error)):
        return None
    return gradient / max(1.0, (R + size**2) * float(np.linalg.norm(own)))


def _free_optimum(G: Array, error: Array, H: Array, R: float) -> tuple[Array, Array, float] | None:
    """y of min ½R‖y‖² + ½‖error + G y‖², H = GᵀG + R, Q^½ e and the gradient's norm; None: not accurate."""
    factor, own, _ = dposv(H.T, -error.dot(G), overwrite_a=1, overwrite_b=1)
    for _ in range(_ROUNDS):
        after = error + G.dot(own)
        slope = R * own + after.dot(G)
        kkt = _accurate(slope, G, error, own, R)
        if kkt is not None:
            return own, after, kkt
        own = own - dpotrs(factor, slope)[0]
    return None


def _bound_optimum(
    G: Array, error: Array, H: Array, R: float, equalities: _Equalities
) -> tuple[Array, Array, Array, Array, float] | None:
    """The same on the equalities, with y_rest = −A_restᵀλ/R: own coordinates, λ, the coordinates beyond,
    Q^½ e, KKT residual. None also if the rows are dependent."""
    A_own, A_rest, target = equalities
    d, corner = len(H), A_rest.dot(A_rest.T / -R)
    K = np.empty((d + target.size, d + target.size))
    K[:d, :d], K[d:, :d], K[:d, d:], K[d:, d:] = H, A_own, A_own.T, corner
    right = np.concatenate((-error.dot(G), target))
    factor, pivots, x, info = dgesv(K.T, right, overwrite_a=1, overwrite_b=1)
    if info != 0:
        return None
    for _ in range(_ROUNDS):
        own, multipliers = x[:d], x[d:]
        after = error + G.dot(own)
        slope = R * own + after.dot(G) + multipliers.dot(A_own)
        kkt = _accurate(slope, G, error, own, R)
        if kkt is not None:
            return own, multipliers, multipliers.dot(A_rest) / -R, after, kkt
        lost = A_own @ own + corner @ multipliers - target
        x = x - dgetrs(factor, pivots, np.concatenate((slope, lost)))[0]
    return None


def _within(
    points: Sequence[_Solved], Q: Array, y: Array, rows: Rows
) -> tuple[list[Point], ActiveRows | None]:
    """The points up to the first whose increments Q y violate a row or leave room at an active one.

    Returns:
        these points, and the rows to take as active for the first that violates some; None: none does.
    """
    U = np.matmul(Q, y[: len(points), :, :, None])[..., 0]
    value = rows.L @ U
    above, below = rows.upper - value, value - rows.lower
    room = np.minimum(above, below)
    # A comparison with NaN is false, so what is not a number is no point either.
    sound = not points or float(room.min()) >= -_TOLERANCE
    good: list[Point] = []
    for place, (error, active, kkt, status, time_us) in enumerate(points):
        if not sound and not float(room[place].min()) >= -_TOLERANCE:
            row, joint = np.nonzero(room[place] < -_TOLERANCE)
            side = np.where(above[place, row, joint] < below[place, row, joint], 1.0, -1.0)
            return good, active.with_rows(row, joint, side) if row.size else None
        if active.row.size:
            slack = room[place, active.row, active.joint]
            if not float(slack.max()) <= _TOLERANCE:
                return good, None
            active = ActiveRows(active.row, active.joint, active.multiplier, slack)
        good.append(Point(U[place], active, kkt, status, error, time_us=time_us))
    return good, None

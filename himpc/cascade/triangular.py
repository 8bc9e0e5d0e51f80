"""The fast route: all levels from one triangular factorisation per knot, while no bound changes hands."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import accumulate
from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.bases import orthogonal_bases
from himpc.cascade.kernel import level_optimum, room_left
from himpc.cascade.level import NO_ROWS, ActiveRows, LevelProblem, Point
from himpc.cascade.null_space import CLEARLY_REGULAR
from himpc.limits.rows import Rows
from himpc.qp import KKT_TOLERANCE

Array = NDArray[np.float64]

_TOLERANCE = 1e-9
"""N·m: a row violated by less counts as met."""
_ACCURACY = 1e-8
"""N·m: how far a point may be from the optimum, since H ≥ R; the normal equations can lose more."""
_PASSES = 3
"""How often the levels are solved while rows are added; then a QP solver sorts them out."""


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
    Q = _identity(N, n)
    if factors:
        if whole:
            B = np.concatenate([problem.B for problem in problems], axis=1)
        elif B.shape[1] > spans[factors - 1][1]:
            B = np.ascontiguousarray(B[:, : spans[factors - 1][1]])
        Q, regular = orthogonal_bases(B)
        if not regular > CLEARLY_REGULAR:
            return []

    y = np.zeros((len(problems), N, n))
    taken = list(warm)
    points: list[_Solved] = []
    good: list[Point] = []
    for _ in range(_PASSES):
        del points[len(good) :]
        for place in range(len(good), len(spans)):
            start, end = spans[place]
            y[place] = 0.0
            if place:
                y[place, :, :start] = y[place - 1, :, :start]
            found = _level(problems[place], y[place], start, end, Q, rows, taken[place])
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


def _level(
    problem: LevelProblem, y: Array, start: int, end: int, Q: Array, rows: Rows, active: ActiveRows
) -> tuple[Array, ActiveRows, float] | None:
    """One level's coordinates into y: Q^½ e, the rows that hold the optimum and the KKT residual, or None."""
    R = problem.common_R or 0.0
    try:
        found, error, kkt, held, multiplier = level_optimum(
            problem.B,
            problem.weighted_C,
            problem.weighted_free,
            R,
            Q,
            y,
            start,
            end,
            rows.L,
            rows.lower,
            rows.upper,
            active.row,
            active.joint,
            active.multiplier,
            min(_ACCURACY * R, KKT_TOLERANCE),
        )
    except np.linalg.LinAlgError:
        return None  # the rows are dependent
    if not found:
        return None
    if not held.any():
        return error, NO_ROWS, kkt
    pressing = multiplier * active.multiplier
    return error, ActiveRows(active.row, active.joint, multiplier, pressing).only(held), kkt


def _within(
    points: Sequence[_Solved], Q: Array, y: Array, rows: Rows
) -> tuple[list[Point], ActiveRows | None]:
    """The points up to the first whose increments Q y violate a row or leave room at an active one.

    Returns:
        these points, and the rows to take as active for the first that violates some; None: none does.
    """
    U, room, least = room_left(Q, y[: len(points)], rows.L, rows.lower, rows.upper)
    good: list[Point] = []
    for place, (error, active, kkt, status, time_us) in enumerate(points):
        if not least[place] >= -_TOLERANCE:
            row, joint = np.nonzero(room[place] < -_TOLERANCE)
            above = rows.upper - rows.L @ U[place]
            side = np.where(above[row, joint] < -_TOLERANCE, 1.0, -1.0)
            return good, active.with_rows(row, joint, side) if row.size else None
        if active.row.size:
            slack = room[place, active.row, active.joint]
            if not float(slack.max()) <= _TOLERANCE:
                return good, None
            active = ActiveRows(active.row, active.joint, active.multiplier, slack)
        good.append(Point(U[place], active, kkt, status, error, time_us=time_us))
    return good, None

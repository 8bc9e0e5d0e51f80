"""Prepares Problem 1 to Problem r: each level uses the directions that (33) leaves free."""

from __future__ import annotations

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.bases import no_directions, projected_rows, take_directions
from himpc.tick.kernel.bounds import LevelBounds, constraint_values
from himpc.tick.kernel.level import LevelQP
from himpc.tick.kernel.linear import copy_rows, dot

FIRST, LAST, KNOTS, AFRESH, ALONE, OWN_FIRST, OWN_LAST, OWN_KNOTS = range(8)
"""Columns of the table of levels: range of the level's rows; number of knots in its residual; whether its
`metric` differs from that of the level above, so that directions must be computed again; whether the level is
exempt from (33); range of the rows and number of knots of its evidence. The evidence is that of this level
alone, also without priorities."""
SOFTENED = 1.0
"""The last of `FALLBACKS` that applies an optimum."""


@inline_kernel
def own_directions(
    index: int,
    levels: IntArray,
    B: Array,
    metric: Array,
    reflector: Array,
    Q: Array,
    projected_jacobian: Array,
    count: IntArray,
    start: IntArray,
) -> None:
    """Computes the directions Q[j] of a level at every knot j. The first start[j] directions belong to the
    levels above; the next ones, up to count[j], belong to the level."""
    N, _, n = B.shape
    above = 0 if levels[index, ALONE] else index
    afresh = above == 0 or levels[index, AFRESH]
    first, last = levels[index, FIRST], levels[index, LAST]
    # No level needs the directions that the last level leaves. If the last level can use all remaining
    # directions, its rows need no factorisation.
    whole = index == len(levels) - 1 or levels[index, ALONE]
    for j in range(N):
        if afresh:
            no_directions(Q[j])
            count[j] = 0
            for p in range(above):
                projected_rows(
                    B[j],
                    metric,
                    reflector[j],
                    count[j],
                    levels[p, FIRST],
                    levels[p, LAST],
                    projected_jacobian[j],
                )
                count[j] = take_directions(
                    projected_jacobian[j], levels[p, FIRST], levels[p, LAST], count[j], reflector[j], Q[j]
                )
        start[j] = count[j]
        projected_rows(B[j], metric, reflector[j], count[j], first, last, projected_jacobian[j])
        if whole and last - first >= n - count[j]:
            count[j] = n
        else:
            count[j] = take_directions(projected_jacobian[j], first, last, count[j], reflector[j], Q[j])


@inline_kernel
def keep_above(level: LevelQP, U_above: Array, knots: int) -> None:
    """Computes the part of U_{i−1}, (N, n), that (33) fixes: its components along the directions of the
    levels above, and all of U_{i−1} beyond the level's own horizon (Remark 8)."""
    N, n = U_above.shape
    fixed, Q, metric = level.fixed, level.Q, level.metric
    for j in range(N):
        for a in range(n):
            fixed[j, a] = U_above[j, a] if j >= knots else 0.0
        for c in range(level.start[j] if j < knots else 0):
            along = 0.0
            for a in range(n):
                along += Q[j, a, c] * U_above[j, a] / metric[a]
            for a in range(n):
                fixed[j, a] += metric[a] * Q[j, a, c] * along


@inline_kernel
def count_coordinates(
    knots: int, n: int, count: IntArray, start: IntArray, offset: IntArray, rest: IntArray
) -> int:
    """Writes the indices of the level's own coordinates and of the others, see `LevelQP`; returns the number
    of both together."""
    N = len(start)
    offset[0] = 0
    for j in range(N):
        offset[j + 1] = offset[j] + (count[j] - start[j] if j < knots else 0)
    rest[0] = offset[N]
    for j in range(N):
        rest[j + 1] = rest[j] + (n - count[j] if j < knots else 0)
    return rest[N]


@inline_kernel
def prepare_bounds(
    index: int,
    levels: IntArray,
    level: LevelQP,
    bounds: LevelBounds,
    lower: Array,
    upper: Array,
    U: Array,
    room: float,
) -> bool:
    """Computes the bounds of Problem i and the part of its increments that (33) fixes. If (33) fixes all
    increments, the function writes them to U[i] and returns False.

    Args:
        index, levels: i and the table of levels.
        level, bounds: the results.
        lower, upper: all bounds, (b, n) N·m.
        U: (r, N, n) increments of all levels; those of the levels above are known.
        room: N·m by which bounds are widened around U_{i−1}.
    """
    if index == 0 or levels[index, ALONE] == 1:
        level.fixed[:] = 0.0
        copy_rows(lower, bounds.low)
        copy_rows(upper, bounds.high)
        return True
    keep_above(level, U[index - 1], levels[index, KNOTS])
    # U_{i−1} meets the bounds up to rounding; it must stay feasible exactly (Theorem 2).
    value = bounds.value
    constraint_values(U[index - 1], bounds)
    for r in range(len(value)):
        for a in range(U.shape[2]):
            bounds.low[r, a] = min(lower[r, a], value[r, a] - room)
            bounds.high[r, a] = max(upper[r, a], value[r, a] + room)
    if level.rest[U.shape[1]] > 0:
        return True
    copy_rows(U[index - 1], U[index])
    return False


@inline_kernel
def predict(
    q: Array, v: Array, v_was: Array, U: Array, M_bar: Array, period: float, T_s: float, path: Array
) -> None:
    """Computes q at knots 0 … N under the increments, (N+1, n), by (18), see `himpc.prediction`."""
    for a in range(q.size):
        position, speed, acceleration = q[a], v[a], (v[a] - v_was[a]) / period
        path[0, a] = position
        for j in range(len(U)):
            acceleration += U[j, a] / M_bar[a]
            position += T_s * speed
            speed += T_s * acceleration
            path[j + 1, a] = position


@inline_kernel
def finite(x: Array) -> bool:
    """Returns whether all numbers are finite, and so small that their squares and differences cannot
    overflow."""
    return dot(x, x, x.size) < 1e18

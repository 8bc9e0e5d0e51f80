"""Solves one QP of HTMPC by the dual method of `goldfarb_idnani`. This module handles the rows and chooses
the most violated row."""

from __future__ import annotations

import math

from himpc.compilation.compiled import INDICES, MATRICES, MATRIX, TABLE, VECTOR, WHOLE, inline_kernel, kernel
from himpc.compilation.views import borrowed
from himpc.tick.kernel.active_set import (
    ActiveSet,
    Quadratic,
    correct,
    evaluate,
    point_from_multipliers,
    remove_row,
    scale,
    unscale,
    update_multipliers,
)
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.goldfarb_idnani import ROUNDED, TOLERANCE, dual_step, release
from himpc.tick.kernel.linear import copy, copy_rows, dot, factorise, forward, subtract

SOLVED, CONTRADICTION, LIMIT = range(3)
VECTORS = 8
"""Number of rows of the array `vectors` of `solve`."""
_STEPS = 600
"""Budget of one QP, as a number of added or removed rows. It bounds the computing time."""
_ROUGH = 1e-8
"""At a point that was not refined, a smaller violation may be a rounding error."""
_CLOSE = 0.05
"""Rows with a bound near x = 0 are checked first. A bound is near if its distance is less than this share of
the row's range, or of one unit if the range is larger."""


@inline_kernel
def residual_of(
    H: Array,
    g: Array,
    A: Array,
    lower: Array,
    upper: Array,
    x: Array,
    multipliers: Array,
    value: Array,
    gradient: Array,
) -> float:
    """Returns the same number as `himpc.qp.kkt_residual`; value is Ax, and gradient is scratch, (n,)."""
    n = len(g)
    squares, worst, total = 0.0, 0.0, 0.0
    for i in range(n):
        gradient[i] = g[i] + dot(H[i], x, n)
        squares += dot(H[i], H[i], n)
    scale = max(1.0, math.sqrt(squares) * math.sqrt(dot(x, x, n)), math.sqrt(dot(g, g, n)))
    for i in range(len(A)):
        worst = max(worst, lower[i] - value[i], value[i] - upper[i])
        if multipliers[i] != 0.0:
            own = upper[i] - value[i] if multipliers[i] > 0.0 else value[i] - lower[i]
            worst = max(worst, abs(multipliers[i]) * min(abs(own), 1e6) / scale)
            subtract(-multipliers[i], A[i], gradient, n)
    for i in range(n):
        worst = max(worst, abs(gradient[i]) / scale)
        total += x[i]
    # `max` may ignore NaN; a sum does not.
    return worst if math.isfinite(total) else math.inf


@kernel(MATRIX, MATRIX)
def factor(H: Array, L: Array) -> bool:
    """Writes L of H = LLᵀ to the lower triangle of L (n, n); returns False if H is not positive definite."""
    H, L = borrowed(H), borrowed(L)
    copy_rows(H, L)
    return factorise(L, len(L))


@inline_kernel
def hold(active: ActiveSet, index: int, upper_side: bool, lower: Array, upper: Array) -> None:
    """Sets side and target of a row that becomes active. An equality has side 0 and is never removed."""
    i = active.row[index]
    active.target[index] = upper[i] if upper_side else lower[i]
    active.side[index] = 0 if lower[i] == upper[i] else (1 if upper_side else -1)


@inline_kernel
def refine(
    active: ActiveSet, cost: Quadratic, k: int, H: Array, g: Array, slope: Array, z: Array, x: Array
) -> None:
    """Removes the rounding errors of the accumulated steps from a point and its multipliers."""
    for i in range(len(g)):
        slope[i] = g[i] + dot(H[i], x, len(g))
    evaluate(active, x, k, len(g), slope)
    correct(active, cost, k, slope, z, x)


@kernel(
    *(MATRIX, MATRIX, VECTOR, MATRIX, VECTOR, VECTOR),
    *(TABLE, WHOLE, MATRICES, MATRIX, MATRIX, INDICES, VECTOR, VECTOR, VECTOR),
)
def solve(
    L: Array,
    H: Array,
    g: Array,
    A: Array,
    lower: Array,
    upper: Array,
    held: IntArray,
    count: int,
    normals: Array,
    cholesky_factor: Array,
    vectors: Array,
    watched: IntArray,
    value: Array,
    x: Array,
    multipliers: Array,
) -> tuple[float, int, int]:
    """Solves min ½xᵀHx + gᵀx under lower ≤ Ax ≤ upper. Returns the KKT residual, the status (SOLVED,
    CONTRADICTION or LIMIT), and the number of active rows.

    Args:
        L, H, g, A, lower, upper: the QP, H = LLᵀ (n, n).
        held, normals, cholesky_factor, vectors: the `ActiveSet` and scratch, of the shapes (3, n + 1),
            (3, n + 1, n), (n + 1, n + 1) and (VECTORS, n + 1).
        count: the number of active rows of the previous QP.
        watched, value: scratch, one entry per row of A.
        x: (n,), the result.
        multipliers: the result, one entry per row of A; zero at the call.
    """
    n, rows = len(g), len(A)
    A, H, L, vectors = borrowed(A), borrowed(H), borrowed(L), borrowed(vectors)
    normals, cholesky_factor = borrowed(normals), borrowed(cholesky_factor)
    ideal, z, slope, budget = vectors[0], vectors[1], vectors[2], vectors[3]
    active = ActiveSet(
        *(held[0], held[1], held[2], normals[0], normals[1], normals[2], cholesky_factor),
        *(vectors[4], vectors[5], vectors[6], vectors[7]),
    )
    cost = Quadratic(L, ideal, 1.0, n, n)
    budget[0] = _STEPS * n * (rows + 12.0 * n)
    for i in range(n):
        ideal[i] = -g[i]
    forward(L, ideal, n)
    for i in range(rows):
        near = _CLOSE * min(upper[i] - lower[i], 1.0)
        watched[i] = lower[i] > -near or upper[i] < near
    for p in range(count):
        watched[active.row[p]] = 1
    # Active rows of the previous QP are kept if their multipliers have the right sign in this QP.
    for p in range(count - 1, -1, -1):
        hold(active, p, active.multiplier[p] > 0.0, lower, upper)
        if not math.isfinite(active.target[p]):
            remove_row(active, p, count, n, budget)
            count -= 1
    update_multipliers(active, cost, count)
    count = release(active, cost, count, budget)
    point_from_multipliers(active, cost, count, z)
    unscale(cost, z, x)
    if count:
        refine(active, cost, count, H, g, slope, z, x)
    status, exact = LIMIT, True
    while budget[0] > 0.0:
        budget[0] -= n * (rows + 2.0 * n + 2.0 * count)
        p, excess, above = -1, TOLERANCE if exact else _ROUGH, False
        for i in range(rows):
            if watched[i]:
                value[i] = dot(A[i], x, n)
                missing = max(lower[i] - value[i], value[i] - upper[i])
                if missing > excess and watched[i] != 2:
                    p, excess, above = i, missing, value[i] > upper[i]
        if p < 0:
            if not exact:
                refine(active, cost, count, H, g, slope, z, x)
                exact = True
                continue
            status = SOLVED
            for i in range(rows):
                if not watched[i]:
                    value[i] = dot(A[i], x, n)
                    if max(lower[i] - value[i], value[i] - upper[i]) > TOLERANCE:
                        watched[i], status = 1, LIMIT
            if status == SOLVED:
                break
            continue
        active.row[count], active.side[count] = p, 1 if above else -1
        copy(A[p], active.normal[count], n)
        scale(cost, active.normal[count], active.scaled_normal[count])
        if exact:
            point_from_multipliers(active, cost, count, z)
        met, count = dual_step(active, count, excess, z, n, budget)
        if met:
            hold(active, count - 1, above, lower, upper)
        elif budget[0] < 0.0:
            break
        elif exact and excess > ROUNDED:
            return math.inf, CONTRADICTION, count
        else:
            watched[p] = 2 if exact else 1
            update_multipliers(active, cost, count)
            count = release(active, cost, count, budget)
            point_from_multipliers(active, cost, count, z)
        unscale(cost, z, x)
        # At a point that was not refined, the violation of a linearly dependent row may be a rounding error.
        exact = not met
        if exact:
            refine(active, cost, count, H, g, slope, z, x)
    for p in range(count):
        multipliers[active.row[p]] += active.multiplier[p]
    for i in range(0 if status == SOLVED else rows):
        value[i] = dot(A[i], x, n)
    return residual_of(H, g, A, lower, upper, x, multipliers, value, slope), status, count

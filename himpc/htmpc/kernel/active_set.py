"""The compiled dual method of Goldfarb and Idnani for one QP, see `htmpc.active_set`."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from himpc.compilation.compiled import INDICES, MATRIX, VECTOR, WHOLE, inline_kernel, kernel
from himpc.compilation.views import borrowed
from himpc.tick.kernel.linear import (
    backward,
    close_gap,
    copy,
    copy_rows,
    dot,
    factorise,
    forward,
    split,
    subtract,
)

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

SOLVED, CONTRADICTION, LIMIT = range(3)
SCRATCH = 7
"""Number of rows of the scratch array."""
MOST_STEPS = 600
"""Largest number of rows that are added or removed in one QP: it bounds the computing time."""
_CLOSE = 0.05
"""Rows whose bound is nearer to x = 0 than this share of their range, or of one unit, are checked first."""
_SATISFIED = 1e-9
_DEPENDENT = 1e-10
"""A row depends on the active rows if its part outside their span is shorter than this share of its
length."""
_ENOUGH = 0.5
"""See `split`: if less than this share of a row is left, a second round of orthogonalisation follows."""
_ROUNDING = 1e-7
"""Largest violation of a row that depends on the others; a larger one is a contradiction."""


@inline_kernel
def residual_of(
    H: Array,
    g: Array,
    A: Array,
    lower: Array,
    upper: Array,
    x: Array,
    multipliers: Array,
    gradient: Array,
) -> float:
    """Returns `himpc.qp.kkt_residual`; gradient is scratch, (n,)."""
    n = len(g)
    squares, worst, total = 0.0, 0.0, 0.0
    for i in range(n):
        gradient[i] = g[i] + dot(H[i], x, n)
        squares += dot(H[i], H[i], n)
    scale = max(1.0, math.sqrt(squares) * math.sqrt(dot(x, x, n)), math.sqrt(dot(g, g, n)))
    for i in range(len(A)):
        value = dot(A[i], x, n)
        worst = max(worst, lower[i] - value, value - upper[i])
        if multipliers[i] != 0.0:
            own = upper[i] - value if multipliers[i] > 0.0 else value - lower[i]
            worst = max(worst, abs(multipliers[i]) * min(abs(own), 1e6) / scale)
            subtract(-multipliers[i], A[i], gradient, n)
    for i in range(n):
        worst = max(worst, abs(gradient[i]) / scale)
        total += x[i]
    # `max` may ignore NaN, a sum cannot.
    return worst if math.isfinite(total) else math.inf


@inline_kernel
def bounds_of(active: Indices, side: Array, count: int, lower: Array, upper: Array, beta: Array) -> None:
    """Writes β of the active rows."""
    for c in range(count):
        beta[c] = lower[active[c]] if side[c] > 0.0 else -upper[active[c]]


@inline_kernel
def at_rows(
    cholesky_factor: Array,
    orthonormal_basis: Array,
    z_0: Array,
    beta: Array,
    y: Array,
    u: Array,
    z: Array,
    count: int,
) -> None:
    """Writes z and u for the active rows as equalities: F (y + B z₀) = β, z = z₀ + Bᵀy, Fᵀu = y, with the
    Cholesky factor F and the orthonormal basis B."""
    n = len(z)
    copy(beta, y, count)
    forward(cholesky_factor, y, count)
    copy(z_0, z, n)
    for i in range(count):
        y[i] -= dot(orthonormal_basis[i], z_0, n)
        subtract(-y[i], orthonormal_basis[i], z, n)
    copy(y, u, count)
    backward(cholesky_factor, u, count)


@inline_kernel
def let_go(
    cholesky_factor: Array,
    orthonormal_basis: Array,
    active: Indices,
    side: Array,
    u: Array,
    index: int,
    count: int,
) -> None:
    """Removes the active row at an index."""
    for c in range(index, count - 1):
        active[c], side[c], u[c] = active[c + 1], side[c + 1], u[c + 1]
    close_gap(cholesky_factor, orthonormal_basis, index, count, orthonormal_basis.shape[1])


@kernel(MATRIX, MATRIX)
def factor(H: Array, L: Array) -> bool:
    """Writes L of H = LLᵀ to the lower triangle of L (n, n); returns False if H is not positive definite."""
    H, L = borrowed(H), borrowed(L)
    copy_rows(H, L)
    return factorise(L, len(L))


@kernel(
    *(MATRIX, MATRIX, VECTOR, MATRIX, VECTOR, VECTOR),
    *(INDICES, VECTOR, WHOLE, MATRIX, MATRIX, MATRIX, INDICES, INDICES, VECTOR, VECTOR),
)
def solve(
    L: Array,
    H: Array,
    g: Array,
    A: Array,
    lower: Array,
    upper: Array,
    active: Indices,
    side: Array,
    count: int,
    cholesky_factor: Array,
    orthonormal_basis: Array,
    scratch: Array,
    watched: Indices,
    seen: Indices,
    x: Array,
    multipliers: Array,
) -> tuple[float, int, int]:
    """Solves min ½xᵀHx + gᵀx under lower ≤ Ax ≤ upper. Returns the KKT residual, the status (SOLVED,
    CONTRADICTION or LIMIT), and the number of active rows.

    Args:
        L, H, g, A, lower, upper: the QP, H = LLᵀ (n, n).
        active, side, count: the active rows, space for n; on entry those of the QP before.
        cholesky_factor, orthonormal_basis: of the active rows, see `linear`, space for n + 1.
        scratch: (SCRATCH, n + 1).
        watched, seen: scratch, as long as A; seen is zero.
        x: (n,), the result.
        multipliers: as long as A, zero; the result.
    """
    n, rows = len(g), len(A)
    A, H, L, scratch = borrowed(A), borrowed(H), borrowed(L), borrowed(scratch)
    cholesky_factor, orthonormal_basis = borrowed(cholesky_factor), borrowed(orthonormal_basis)
    z_0, z, normal = scratch[0, :n], scratch[1, :n], scratch[2, :n]
    r, u, y, beta = scratch[3], scratch[4], scratch[5], scratch[6]
    for i in range(n):
        z_0[i] = -g[i]
    forward(L, z_0, n)
    watching = 0
    for i in range(rows):
        near = _CLOSE * min(upper[i] - lower[i], 1.0)
        if lower[i] > -near or upper[i] < near:
            seen[i] = 1
    for c in range(count):
        seen[active[c]] = 1
    for i in range(rows):
        if seen[i]:
            watched[watching] = i
            watching += 1
    # Active rows of the QP before are kept if their multipliers have the right sign here.
    while True:
        bounds_of(active, side, count, lower, upper, beta)
        at_rows(cholesky_factor, orthonormal_basis, z_0, beta, y, u, z, count)
        least, worst = 0.0, -1
        for c in range(count):
            free = lower[active[c]] < upper[active[c]]
            if not math.isfinite(beta[c]):
                least, worst = -math.inf, c
            elif free and u[c] < least:
                least, worst = u[c], c
        if worst < 0:
            break
        let_go(cholesky_factor, orthonormal_basis, active, side, u, worst, count)
        count -= 1
    status, steps = LIMIT, 0
    while steps < MOST_STEPS:
        copy(z, x, n)
        backward(L, x, n)
        p, excess, sign = -1, 0.0, 0.0
        for index in range(watching):
            i = watched[index]
            value = dot(A[i], x, n)
            missing = max(lower[i] - value, value - upper[i])
            if missing > max(excess, _SATISFIED) and seen[i] != 2:
                p, excess = i, missing
                sign = 1.0 if value < lower[i] else -1.0
        if p < 0:
            # This removes the rounding errors of the accumulated steps before the other rows are checked.
            bounds_of(active, side, count, lower, upper, beta)
            at_rows(cholesky_factor, orthonormal_basis, z_0, beta, y, u, z, count)
            copy(z, x, n)
            backward(L, x, n)
            more = False
            for i in range(rows):
                if seen[i] == 0:
                    value = dot(A[i], x, n)
                    if max(lower[i] - value, value - upper[i]) > _SATISFIED:
                        seen[i], more = 1, True
                        watched[watching] = i
                        watching += 1
            if more:
                continue
            status = SOLVED
            break
        for i in range(n):
            normal[i] = sign * A[p, i]
        forward(L, normal, n)
        bound = lower[p] if sign > 0.0 else -upper[p]
        own, size = 0.0, dot(normal, normal, n)
        while steps < MOST_STEPS:
            steps += 1
            shares, rest = cholesky_factor[count], orthonormal_basis[count]
            across = split(normal, orthonormal_basis, count, n, shares, rest, _ENOUGH)
            copy(shares, r, count)
            backward(cholesky_factor, r, count)
            first, blocking = math.inf, -1
            for c in range(count):
                if r[c] > 0.0 and lower[active[c]] < upper[active[c]] and u[c] < first * r[c]:
                    first, blocking = max(u[c], 0.0) / r[c], c
            missing = bound - dot(normal, z, n)
            depends = across <= _DEPENDENT * _DEPENDENT * size or count == n
            full = math.inf if depends else missing / across
            if depends and blocking < 0:
                if missing > _ROUNDING:
                    return math.inf, CONTRADICTION, count
                seen[p] = 2
                break
            step = min(first, full)
            subtract(step, r, u, count)
            own += step
            if not depends:
                subtract(-step, rest, z, n)
            if full <= first:
                length = math.sqrt(across)
                for i in range(n):
                    rest[i] /= length
                shares[count] = length
                active[count], side[count], u[count] = p, sign, own
                count += 1
                break
            let_go(cholesky_factor, orthonormal_basis, active, side, u, blocking, count)
            count -= 1
    for c in range(count):
        multipliers[active[c]] -= side[c] * u[c]
    return residual_of(H, g, A, lower, upper, x, multipliers, normal), status, count

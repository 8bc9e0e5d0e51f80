"""Compiled linear algebra of small dense matrices. At these sizes the call of a library would take more time
than the computation.

The active rows are stored as cholesky_factor · orthonormal_basis, a lower triangular matrix times orthonormal
rows. Rows are added and removed one by one.
"""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.arrays import Array

_ENOUGH = 0.5
"""If at most this share of ‖row‖² is left, `split` repeats its computation to remove rounding errors."""


@inline_kernel
def dot(a: Array, b: Array, n: int) -> float:
    """Returns aᵀb over the first n elements."""
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return total


@inline_kernel
def subtract(share: float, x: Array, y: Array, n: int) -> None:
    """Computes y ← y − share · x over the first n elements."""
    for i in range(n):
        y[i] -= share * x[i]


@inline_kernel
def copy(x: Array, y: Array, n: int) -> None:
    """Copies the first n elements, y ← x. (`y[:] = x` would also be compiled with code for error
    messages.)"""
    for i in range(n):
        y[i] = x[i]


@inline_kernel
def copy_rows(X: Array, Y: Array) -> None:
    """Copies as many rows as Y has, Y ← X."""
    for i in range(len(Y)):
        copy(X[i], Y[i], Y.shape[1])


@inline_kernel
def factorise(H: Array, d: int) -> bool:
    """Writes the Cholesky factor F of H = F Fᵀ to the lower triangle of H; returns False if H is not
    positive.

    H (d, d) is read from its upper triangle. F is computed row by row from F_j F_iᵀ = H_ij, for four rows i
    at a time. Each row j above is then read once for four rows.
    """
    for i in range(d):
        for j in range(i):
            H[i, j] = H[j, i]
    for i in range(0, d, 4):
        end = min(i + 4, d)
        if end == i + 4:
            a, b, c, e = H[i], H[i + 1], H[i + 2], H[i + 3]
            for j in range(i):
                row, share = H[j], 1.0 / H[j, j]
                sum_a = sum_b = sum_c = sum_e = 0.0
                for k in range(j):
                    x = row[k]
                    sum_a += a[k] * x
                    sum_b += b[k] * x
                    sum_c += c[k] * x
                    sum_e += e[k] * x
                a[j], b[j] = (a[j] - sum_a) * share, (b[j] - sum_b) * share
                c[j], e[j] = (c[j] - sum_c) * share, (e[j] - sum_e) * share
        for p in range(i, end):
            row = H[p]
            for j in range(i if end == i + 4 else 0, p):
                row[j] = (row[j] - dot(row, H[j], j)) / H[j, j]
            left = row[p] - dot(row, row, p)
            if not left > 0.0:
                return False
            row[p] = left**0.5
    return True


@inline_kernel
def forward(F: Array, x: Array, d: int) -> None:
    """Computes x ← F⁻¹ x, F lower triangular. Leading zeros of x stay zero."""
    first = 0
    while first < d and x[first] == 0.0:
        first += 1
    for a in range(first, d):
        x[a] = (x[a] - dot(F[a, first:], x[first:], a - first)) / F[a, a]


@inline_kernel
def backward(F: Array, x: Array, d: int) -> None:
    """Computes x ← F⁻ᵀ x, F lower triangular."""
    for a in range(d - 1, -1, -1):
        x[a] /= F[a, a]
        subtract(x[a], F[a], x, a)


@inline_kernel
def split(row: Array, orthonormal_basis: Array, count: int, n: int, share: Array, rest: Array) -> float:
    """Splits a row (n,) into a combination of the first `count` rows of `orthonormal_basis`, and a rest.

    Args:
        row, orthonormal_basis, count, n: see above.
        share: the coefficients, (count,).
        rest: the remainder, (n,).

    Returns:
        ‖rest‖².
    """
    copy(row, rest, n)
    for q in range(count):
        share[q] = 0.0
    before = after = dot(row, row, n)
    for _ in range(2):
        for q in range(count):
            along = dot(orthonormal_basis[q], rest, n)
            share[q] += along
            subtract(along, orthonormal_basis[q], rest, n)
        after = dot(rest, rest, n)
        if after > _ENOUGH * before:
            break
    return after


@inline_kernel
def close_gap(cholesky_factor: Array, orthonormal_basis: Array, index: int, count: int, n: int) -> None:
    """Removes row `index` of `count` rows. Later rows move up, and rotations make `cholesky_factor` lower
    triangular again."""
    for p in range(index, count - 1):
        for q in range(p + 2):
            cholesky_factor[p, q] = cholesky_factor[p + 1, q]
    for q in range(index, count - 1):
        length = math.hypot(cholesky_factor[q, q], cholesky_factor[q, q + 1])
        if length == 0.0:
            continue
        cos, sin = cholesky_factor[q, q] / length, cholesky_factor[q, q + 1] / length
        for p in range(q, count - 1):
            x, y = cholesky_factor[p, q], cholesky_factor[p, q + 1]
            cholesky_factor[p, q], cholesky_factor[p, q + 1] = cos * x + sin * y, cos * y - sin * x
        for c in range(n):
            x, y = orthonormal_basis[q, c], orthonormal_basis[q + 1, c]
            orthonormal_basis[q, c], orthonormal_basis[q + 1, c] = cos * x + sin * y, cos * y - sin * x

"""The linear algebra of small dense matrices, compiled: at these sizes a call costs more than the work.

Rows that a point is held by are kept as corner · basis: `basis` has orthonormal rows, `corner` is lower
triangular, and rows come and go one by one.
"""

from __future__ import annotations

import math

from himpc.cascade.compiled import piece
from himpc.tick.kernel.arena import Array


@piece
def dot(a: Array, b: Array, n: int) -> float:
    """aᵀb over the first n."""
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return total


@piece
def subtract(share: float, x: Array, y: Array, n: int) -> None:
    """y ← y − share · x over the first n."""
    for i in range(n):
        y[i] -= share * x[i]


@piece
def copy(x: Array, y: Array, n: int) -> None:
    """y ← x over the first n. (`y[:] = x` would be compiled with all that it takes to word an error.)"""
    for i in range(n):
        y[i] = x[i]


@piece
def copy_rows(X: Array, Y: Array) -> None:
    """Y ← X, as many rows as Y has."""
    for i in range(len(Y)):
        copy(X[i], Y[i], Y.shape[1])


@piece
def factorise(H: Array, d: int) -> bool:
    """The lower Cholesky factor F of H = F Fᵀ in place of its lower triangle; False if H is not positive.

    H (d, d) is given by its upper triangle, from the left in panels of four rows: what is left of the matrix
    is then read and written once for four columns, in lines as long as the matrix is wide.
    """
    for k in range(0, d, 4):
        width = min(4, d - k)
        for p in range(k, k + width):
            row = H[p]
            for s in range(k, p):
                subtract(H[s, p], H[s, p:], row[p:], d - p)
            if not row[p] > 0.0:
                return False
            share = 1.0 / row[p] ** 0.5
            for c in range(p, d):
                row[c] *= share
        if width < 4:
            break
        a, b, c, e = H[k], H[k + 1], H[k + 2], H[k + 3]
        for i in range(k + 4, d):
            row = H[i]
            fa, fb, fc, fe = a[i], b[i], c[i], e[i]
            for j in range(i, d):
                row[j] -= fa * a[j] + fb * b[j] + fc * c[j] + fe * e[j]
    for i in range(d):
        for j in range(i):
            H[i, j] = H[j, i]
    return True


@piece
def forward(F: Array, x: Array, d: int) -> None:
    """x ← F⁻¹ x, F lower triangular; what is zero at the beginning stays zero."""
    first = 0
    while first < d and x[first] == 0.0:
        first += 1
    for a in range(first, d):
        x[a] = (x[a] - dot(F[a, first:], x[first:], a - first)) / F[a, a]


@piece
def backward(F: Array, x: Array, d: int) -> None:
    """x ← F⁻ᵀ x, F lower triangular."""
    for a in range(d - 1, -1, -1):
        x[a] /= F[a, a]
        subtract(x[a], F[a], x, a)


@piece
def split(row: Array, basis: Array, count: int, n: int, share: Array, rest: Array, enough: float) -> float:
    """A row (n,) as a combination of the first `count` orthonormal ones of `basis`, and a rest.

    Args:
        row, basis, count, n: see there.
        share: the coefficients, (count,).
        rest: what is left, (n,).
        enough: a second round takes out what rounding left of them, unless this share of ‖row‖² is left.

    Returns:
        ‖rest‖².
    """
    copy(row, rest, n)
    for q in range(count):
        share[q] = 0.0
    before = after = dot(row, row, n)
    for _ in range(2):
        for q in range(count):
            along = dot(basis[q], rest, n)
            share[q] += along
            subtract(along, basis[q], rest, n)
        after = dot(rest, rest, n)
        if after > enough * before:
            break
    return after


@piece
def close_gap(corner: Array, basis: Array, place: int, count: int, n: int) -> None:
    """Takes row `place` out of `count` rows corner · basis; those behind it move up, and rotations make
    `corner` lower triangular again."""
    for p in range(place, count - 1):
        for q in range(p + 2):
            corner[p, q] = corner[p + 1, q]
    for q in range(place, count - 1):
        length = math.hypot(corner[q, q], corner[q, q + 1])
        if length == 0.0:
            continue
        cos, sin = corner[q, q] / length, corner[q, q + 1] / length
        for p in range(q, count - 1):
            x, y = corner[p, q], corner[p, q + 1]
            corner[p, q], corner[p, q + 1] = cos * x + sin * y, cos * y - sin * x
        for c in range(n):
            x, y = basis[q, c], basis[q + 1, c]
            basis[q, c], basis[q + 1, c] = cos * x + sin * y, cos * y - sin * x

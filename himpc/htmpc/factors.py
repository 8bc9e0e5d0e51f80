"""Arithmetic of the active-set method: triangular solves, and N = QᵀR as rows come and go."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.compiled import quick

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@quick
def dot(a: Array, b: Array, count: int) -> float:
    total = 0.0
    for i in range(count):
        total += a[i] * b[i]
    return total


@quick
def forward(L: Array, a: Array, m: Array) -> None:
    """m ← L⁻¹ a; what is zero at the beginning of a stays zero."""
    n = len(a)
    first = 0
    while first < n and a[first] == 0.0:
        m[first] = 0.0
        first += 1
    for i in range(first, n):
        total = a[i]
        for j in range(first, i):
            total -= L[i, j] * m[j]
        m[i] = total / L[i, i]


@quick
def backward(L: Array, z: Array, x: Array) -> None:
    """x ← L⁻ᵀ z."""
    for i in range(len(z)):
        x[i] = z[i]
    for i in range(len(z) - 1, -1, -1):
        x[i] /= L[i, i]
        for j in range(i):
            x[j] -= x[i] * L[i, j]


@quick
def project(Q: Array, n: Array, d: Array, w: Array, count: int) -> float:
    """w ← n − QᵀQn and d ← Qn; returns ‖w‖². What little is left is freed from rounding by a second round."""
    w[:] = n
    d[:count] = 0.0
    before = after = dot(n, n, len(n))
    for _ in range(2):
        for c in range(count):
            along = dot(Q[c], w, len(n))
            d[c] += along
            for i in range(len(n)):
                w[i] -= along * Q[c, i]
        after = dot(w, w, len(n))
        if after > 0.5 * before:
            break
    return after


@quick
def solve_triangular(R: Array, d: Array, r: Array, count: int) -> None:
    """r ← R⁻¹ d."""
    for i in range(count - 1, -1, -1):
        total = d[i]
        for j in range(i + 1, count):
            total -= R[i, j] * r[j]
        r[i] = total / R[i, i]


@quick
def let_go(Q: Array, R: Array, active: Indices, side: Array, u: Array, place: int, count: int) -> None:
    """Lets go of the row at a place; Givens rotations make R triangular again."""
    for c in range(place, count - 1):
        active[c], side[c], u[c] = active[c + 1], side[c + 1], u[c + 1]
        for i in range(c + 2):
            R[i, c] = R[i, c + 1]
    for c in range(place, count - 1):
        a, b = R[c, c], R[c + 1, c]
        length = np.hypot(a, b)
        if length == 0.0:
            continue
        cos, sin = a / length, b / length
        for j in range(c, count - 1):
            a, b = R[c, j], R[c + 1, j]
            R[c, j], R[c + 1, j] = cos * a + sin * b, cos * b - sin * a
        for i in range(Q.shape[1]):
            a, b = Q[c, i], Q[c + 1, i]
            Q[c, i], Q[c + 1, i] = cos * a + sin * b, cos * b - sin * a


@quick
def at_rows(Q: Array, R: Array, z_0: Array, beta: Array, y: Array, u: Array, z: Array, count: int) -> None:
    """z and u for the rows held as equalities: Rᵀ(y + Q z₀) = β, z = z₀ + Qᵀy, R u = y."""
    for i in range(count):
        total = beta[i]
        for j in range(i):
            total -= R[j, i] * y[j]
        y[i] = total / R[i, i]
    z[:] = z_0
    for i in range(count):
        y[i] -= dot(Q[i], z_0, len(z))
        for j in range(len(z)):
            z[j] += y[i] * Q[i, j]
    solve_triangular(R, y, u, count)

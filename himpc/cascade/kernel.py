"""The fast route's arithmetic, compiled: thousands of tiny products that cost more to call than to do."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.compiled import (
    GIVEN,
    GIVEN_INDICES,
    GIVEN_MATRICES,
    GIVEN_MATRIX,
    MATRICES,
    MATRIX,
    NUMBER,
    WHOLE,
    compiled,
    inner,
)

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_ROUNDS = 2
"""The normal equations lose digits on long horizons; one step of refinement brings them back."""
_ROUNDING = 2e-15
"""A gradient below this share of ‖G‖‖e‖ is rounding: no better point can be told from this one."""


class Optimum(NamedTuple):
    """What `level_optimum` found.

    Attributes:
        found: whether a point was found that is accurate enough.
        error: Q^½ e, (N·m,).
        kkt: KKT residual.
        held: which of the rows taken as equalities hold it, (k,).
        multiplier: multipliers of the rows, (k,); only those of rows that hold it count.
    """

    found: bool
    error: Array
    kkt: float
    held: NDArray[np.bool_]
    multiplier: Array


@inner
def _forward(F: Array, x: Array) -> None:
    """x ← F⁻¹ x, F lower triangular."""
    for a in range(x.size):
        total = x[a]
        for b in range(a):
            total -= F[a, b] * x[b]
        x[a] = total / F[a, a]


@inner
def _backward(F: Array, x: Array) -> None:
    """x ← F⁻ᵀ x, F lower triangular."""
    for a in range(x.size - 1, -1, -1):
        x[a] /= F[a, a]
        for b in range(a):
            x[b] -= F[a, b] * x[a]


@inner
def _assemble(B: Array, C: Array, Q: Array, y: Array, start: int, end: int, error: Array, G: Array) -> None:
    """Adds to `error` what the levels above do, and fills G, ∂(Q^½ e)/∂y over the own columns."""
    N, m, n = B.shape
    own = end - start
    seen = np.empty(end)
    for j in range(N):
        for i in range(m):
            above = 0.0
            for c in range(end):
                total = 0.0
                for a in range(n):
                    total += B[j, i, a] * Q[j, a, c]
                seen[c] = total
                if c < start:
                    above += total * y[j, c]
            for knot in range(N):
                weight = C[knot, i, j]
                if weight != 0.0:
                    error[knot * m + i] += weight * above
                    for c in range(own):
                        G[knot * m + i, j * own + c] = weight * seen[start + c]


@inner
def _equalities(
    taken: Indices,
    row: Indices,
    joint: Indices,
    side: Array,
    Q: Array,
    y: Array,
    start: int,
    end: int,
    L: Array,
    lower: Array,
    upper: Array,
) -> tuple[Array, Array, Array]:
    """A y_own + A' y_beyond = target for some rows: A (k, N·own), A' (k, N·(n−end)), target (k,)."""
    N, n = y.shape
    own, over = end - start, n - end
    A = np.empty((taken.size, N * own))
    beyond = np.empty((taken.size, N * over))
    target = np.empty(taken.size)
    for place in range(taken.size):
        r, joined = row[taken[place]], joint[taken[place]]
        limit = upper[r, joined] if side[taken[place]] > 0.0 else lower[r, joined]
        for j in range(N):
            weight = L[r, j]
            for c in range(start):
                limit -= weight * Q[j, joined, c] * y[j, c]
            for c in range(own):
                A[place, j * own + c] = weight * Q[j, joined, start + c]
            for c in range(over):
                beyond[place, j * over + c] = weight * Q[j, joined, end + c]
        target[place] = limit
    return A, beyond, target


@inner
def _bordered(
    G: Array, error: Array, F: Array, A: Array, beyond: Array, target: Array, R: float, accuracy: float
) -> tuple[Array, Array, Array, float]:
    """min ½R‖x‖² + ½R‖x'‖² + ½‖error + G x‖² with A x + beyond x' = target, F the factor of GᵀG + R.

    Returns:
        x, the multipliers λ (x' = −beyondᵀλ/R), error + G x, and the KKT residual; −1 for that if the
        gradient is too large.
    """
    d, k = F.shape[0], target.size
    W = A.copy()
    E = np.empty((k, k))
    corner = np.empty((k, k))
    if k:
        corner = np.dot(beyond, beyond.T) / R
        for a in range(k):
            _forward(F, W[a])
        E = np.linalg.cholesky(np.dot(W, W.T) + corner)
    x, pull = np.zeros(d), np.zeros(k)
    slope, lost, after = np.dot(error, G), -target, error
    for _ in range(_ROUNDS):
        z = -slope
        _forward(F, z)
        if k:
            change = np.dot(W, z) + lost
            _forward(E, change)
            _backward(E, change)
            z -= np.dot(change, W)
            pull += change
        _backward(F, z)
        x += z
        after = error + np.dot(G, x)
        slope = R * x + np.dot(after, G)
        if k:
            slope += np.dot(pull, A)
            lost = np.dot(A, x) - np.dot(corner, pull) - target
        gradient = np.sqrt(np.dot(slope, slope))
        if gradient <= accuracy:
            return x, pull, after, gradient
        size = np.sqrt((G * G).sum())
        if gradient <= _ROUNDING * size * np.sqrt(np.dot(error, error)):
            return x, pull, after, gradient / max(1.0, (R + size * size) * np.sqrt(np.dot(x, x)))
    return x, pull, after, -1.0


@compiled(
    *(GIVEN_MATRICES, GIVEN_MATRICES, GIVEN_MATRIX, NUMBER, MATRICES, MATRIX, WHOLE, WHOLE),
    *(MATRIX, GIVEN_MATRIX, GIVEN_MATRIX, GIVEN_INDICES, GIVEN_INDICES, GIVEN, NUMBER),
)
def level_optimum(
    B: Array,
    C: Array,
    free: Array,
    R: float,
    Q: Array,
    y: Array,
    start: int,
    end: int,
    L: Array,
    lower: Array,
    upper: Array,
    row: Indices,
    joint: Indices,
    side: Array,
    accuracy: float,
) -> Optimum:
    """Solves for coordinates start … n of one level, U_j = Q_j y_j, and writes them into y.

    min ½R‖y‖² + ½‖error + G y‖² over coordinates start … end, with the given rows as equalities that the
    coordinates beyond `end` may help to keep: the level does not feel those. Rows whose multiplier has not
    the sign of `side` are let go, and the rest is solved again.

    Args:
        B, C, free: Ĵ M̄⁻¹ (N, m, n), √Q C (N, m, N) and √Q e at U = 0 (N, m).
        R: weight of the increments, the same for all joints.
        Q: bases, (N, n, n); B_j sees the first `end` coordinates only.
        y: (N, n) coordinates of the levels above in columns up to `start`, zero beyond.
        start, end: the level's own columns.
        L, lower, upper: all bounds.
        row, joint, side: rows to take as equalities, and which side they press on, (k,).
        accuracy: the gradient that a point may have, N·m times R.
    """
    N, m, n = B.shape
    own, count = end - start, row.size
    d = N * own
    error = free.copy().reshape(N * m)
    G = np.zeros((N * m, d))
    _assemble(B, C, Q, y, start, end, error, G)
    held = np.zeros(count, np.bool_)
    multiplier = np.zeros(count)
    if own == 0:
        return Optimum(True, error, 0.0, held, multiplier)
    H = np.dot(G.T, G)
    for a in range(d):
        H[a, a] += R
    F = np.linalg.cholesky(H)
    held[:] = True
    while True:
        taken = np.flatnonzero(held)
        A, beyond, target = _equalities(taken, row, joint, side, Q, y, start, end, L, lower, upper)
        x, pull, after, gradient = _bordered(G, error, F, A, beyond, target, R, accuracy)
        if gradient < 0.0:
            return Optimum(False, error, 0.0, held, multiplier)
        multiplier[taken] = pull
        wrong = taken[~(pull * side[taken] > 0.0)]
        if wrong.size == 0:
            y[:, start:end] = x.reshape(N, own)
            if taken.size:
                y[:, end:] = (np.dot(pull, beyond) / -R).reshape(N, n - end)
            return Optimum(True, after, gradient, held, multiplier)
        held[wrong] = False


@compiled(MATRICES, MATRICES, MATRIX, GIVEN_MATRIX, GIVEN_MATRIX)
def room_left(Q: Array, y: Array, L: Array, lower: Array, upper: Array) -> tuple[Array, Array, Array]:
    """U_j = Q_j y_j of every level, y (levels, N, n), the room at each row, (levels, r, n), negative where
    it is violated, and the least room of each level."""
    levels, N, n = y.shape
    U = np.zeros((levels, N, n))
    room = np.empty((levels, L.shape[0], n))
    least = np.full(levels, np.inf)
    for level in range(levels):
        for j in range(N):
            for a in range(n):
                for c in range(n):
                    U[level, j, a] += Q[j, a, c] * y[level, j, c]
        value = np.dot(L, U[level])
        for r in range(L.shape[0]):
            for a in range(n):
                nearest = min(upper[r, a] - value[r, a], value[r, a] - lower[r, a])
                room[level, r, a] = nearest
                # What is not a number must not pass for room.
                least[level] = min(least[level], nearest if nearest == nearest else -np.inf)
    return U, room, least

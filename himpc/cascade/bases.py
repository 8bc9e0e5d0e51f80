"""One QR factorisation per knot: coordinates in which a cascade of tasks is triangular."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.compiled import GIVEN_MATRICES, compiled, inner

Array = NDArray[np.float64]


@inner
def _reflect(v: Array, x: Array, first: int) -> None:
    """x ← (1 − v vᵀ) x from index `first` on, ‖v‖² = 2."""
    along = 0.0
    for a in range(first, v.size):
        along += v[a] * x[a]
    for a in range(first, v.size):
        x[a] -= along * v[a]


@compiled(GIVEN_MATRICES)
def orthogonal_bases(B: Array) -> tuple[Array, float]:
    """Q (N, n, n) of the Householder QR factorisation of each B_jᵀ = Q_j T_j, B (N, s, n) with s ≤ n.

    Also the least diagonal entry of any T_j over the greatest, in magnitude.
    """
    N, s, n = B.shape
    Q = np.zeros((N, n, n))
    T = np.empty((n, s))
    reflectors = np.empty((s, n))
    least, greatest = np.inf, 0.0
    for j in range(N):
        for c in range(s):
            for a in range(n):
                T[a, c] = B[j, c, a]
        for c in range(s):
            norm = 0.0
            for a in range(c, n):
                norm += T[a, c] * T[a, c]
            norm = np.sqrt(norm)
            least, greatest = min(least, norm), max(greatest, norm)
            v = reflectors[c]
            v[c:] = T[c:, c]
            v[c] += norm if v[c] >= 0.0 else -norm
            length = 0.0
            for a in range(c, n):
                length += v[a] * v[a]
            scale = np.sqrt(2.0 / length) if length > 0.0 else 0.0
            v[c:] *= scale
            for other in range(c + 1, s):
                _reflect(v, T[:, other], c)
        for c in range(n):
            Q[j, c, c] = 1.0
        for c in range(s - 1, -1, -1):
            for column in range(c, n):
                _reflect(reflectors[c], Q[j, :, column], c)
    return Q, least / greatest if greatest > 0.0 else 0.0

"""The compiled Gauss-Newton model of a tracking cost."""

from __future__ import annotations

from himpc.compilation.compiled import FIXED, GIVEN_MATRIX, MATRICES, MATRIX, NUMBER, VECTOR, kernel
from robots.arrays import Array


@kernel(
    *(MATRICES, GIVEN_MATRIX, GIVEN_MATRIX, FIXED, MATRIX, NUMBER, NUMBER),
    *(MATRICES, MATRIX, MATRIX, VECTOR),
)
def model(
    J: Array,
    Q: Array,
    e: Array,
    T_q: Array,
    effort: Array,
    share: float,
    ridge: float,
    weighted: Array,
    pull: Array,
    H: Array,
    g: Array,
) -> None:
    """See `gauss_newton`; H (k, k) and g (k,) are the result.

    Args:
        J, Q, e, T_q, effort, share, ridge: see `gauss_newton`.
        weighted, pull: scratch for J_kᵀ Q_k J_k and J_kᵀ Q_k e_k, (N, n, n) and (N, n); zero at the call.
        H, g: the result; g is zero at the call.
    """
    N, m, n = J.shape
    for k in range(N):
        for p in range(m):
            for a in range(n):
                x = Q[k, p] * J[k, p, a]
                pull[k, a] += x * e[k, p]
                for b in range(n):
                    weighted[k, a, b] += x * J[k, p, b]
    for s in range(N):
        for k in range(s, N):
            for a in range(n):
                g[s * n + a] += T_q[k, s] * pull[k, a]
        for r in range(s + 1):
            for a in range(n):
                for b in range(n):
                    H[s * n + a, r * n + b] = share * effort[s * n + a, r * n + b]
            for k in range(s, N):
                both = T_q[k, s] * T_q[k, r]
                for a in range(n):
                    for b in range(n):
                        H[s * n + a, r * n + b] += both * weighted[k, a, b]
    for i in range(N * n):
        for j in range(i):
            H[j, i] = H[i, j]
        H[i, i] += ridge

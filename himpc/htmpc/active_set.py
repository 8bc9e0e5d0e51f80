"""A dual active-set method (Goldfarb and Idnani) for min ½xᵀHx + gᵀx under lower ≤ Ax ≤ upper, compiled.

With H = LLᵀ and z = Lᵀx the cost is ½‖z − z₀‖² and a row a becomes n = ±L⁻¹a, nᵀz ≥ β. The method starts at
the unconstrained optimum and takes in violated rows one by one, highest violation first, while no multiplier
falls below zero; rows whose multiplier would do so leave. The rows held are kept as N = QᵀR with
orthonormal rows of Q, so that no row that depends on them can enter: it replaces one of them, or the rows
contradict each other.
"""

from __future__ import annotations

from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.compiled import INDICES, MATRIX, VECTOR, WHOLE, compiled, quick
from himpc.htmpc.factors import at_rows, backward, dot, forward, let_go, project, solve_triangular
from himpc.htmpc.rows import Rows
from himpc.qp import QPSolution

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

CONTRADICTION = "contradiction"
"""The status of a QP that no point satisfies."""
_STATUS = ("optimal", CONTRADICTION, "limit")
_SOLVED, _CONTRADICTION, _LIMIT = range(3)
MOST_STEPS = 600
"""Rows taken in or let go in one QP: its time is bounded."""
_CLOSE = 0.05
"""Rows whose bound is nearer to x = 0 than this share of their range, or of one unit, are watched first."""
_SATISFIED = 1e-9
_DEPENDENT = 1e-10
"""A row whose part outside the span of those held is shorter than this share of it depends on them."""
_ROUNDING = 1e-7
"""By how much a row that depends on the others may be missed: more is a contradiction."""


@quick
def _residual(
    H: Array, g: Array, A: Array, lower: Array, upper: Array, x: Array, multipliers: Array
) -> float:
    """`himpc.qp.kkt_residual`."""
    n = len(g)
    gradient = g.copy()
    squares = 0.0
    for i in range(n):
        for j in range(n):
            gradient[i] += H[i, j] * x[j]
            squares += H[i, j] * H[i, j]
    scale = max(1.0, np.sqrt(squares) * np.sqrt(dot(x, x, n)), np.sqrt(dot(g, g, n)))
    worst = 0.0
    for i in range(len(A)):
        value = dot(A[i], x, n)
        worst = max(worst, lower[i] - value, value - upper[i])
        if multipliers[i] != 0.0:
            own = upper[i] - value if multipliers[i] > 0.0 else value - lower[i]
            worst = max(worst, abs(multipliers[i]) * min(abs(own), 1e6) / scale)
            for j in range(n):
                gradient[j] += multipliers[i] * A[i, j]
    total = 0.0
    for i in range(n):
        worst = max(worst, abs(gradient[i]) / scale)
        total += x[i]
    # `max` may lose what is not a number: the sum cannot.
    return worst if np.isfinite(total) else np.inf


@compiled(
    *(MATRIX, MATRIX, VECTOR, MATRIX, VECTOR, VECTOR),
    *(INDICES, VECTOR, WHOLE, MATRIX, MATRIX),
    by=quick,
)
def _solve(
    L: Array,
    H: Array,
    g: Array,
    A: Array,
    lower: Array,
    upper: Array,
    active: Indices,
    side: Array,
    count: int,
    Q: Array,
    R: Array,
) -> tuple[Array, Array, float, int, int]:
    n, rows = len(g), len(A)
    most = min(n, len(active))
    z_0, z, x, w, normal = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    d, r, u, y, beta = (
        np.empty(most + 1),
        np.empty(most + 1),
        np.zeros(most + 1),
        np.empty(most + 1),
        np.empty(most + 1),
    )
    watched = np.empty(rows, np.intp)
    seen = np.zeros(rows, np.uint8)
    watching = 0
    forward(L, -g, z_0)
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
    # Rows held from before are kept as far as their multipliers have the right sign here.
    while True:
        for c in range(count):
            beta[c] = lower[active[c]] if side[c] > 0.0 else -upper[active[c]]
        at_rows(Q, R, z_0, beta, y, u, z, count)
        least, worst = 0.0, -1
        for c in range(count):
            free = lower[active[c]] < upper[active[c]]
            if not np.isfinite(beta[c]):
                least, worst = -np.inf, c
            elif free and u[c] < least:
                least, worst = u[c], c
        if worst < 0:
            break
        let_go(Q, R, active, side, u, worst, count)
        count -= 1
    status, steps = _LIMIT, 0
    while steps < MOST_STEPS:
        backward(L, z, x)
        p, excess, sign = -1, 0.0, 0.0
        for place in range(watching):
            i = watched[place]
            value = dot(A[i], x, n)
            missing = max(lower[i] - value, value - upper[i])
            if missing > max(excess, _SATISFIED) and seen[i] != 2:
                p, excess = i, missing
                sign = 1.0 if value < lower[i] else -1.0
        if p < 0:
            # What adding up steps has lost comes back before the other rows are looked at.
            for c in range(count):
                beta[c] = lower[active[c]] if side[c] > 0.0 else -upper[active[c]]
            at_rows(Q, R, z_0, beta, y, u, z, count)
            backward(L, z, x)
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
            status = _SOLVED
            break
        forward(L, A[p], normal)
        for i in range(n):
            normal[i] *= sign
        bound = lower[p] if sign > 0.0 else -upper[p]
        own, size = 0.0, dot(normal, normal, n)
        while steps < MOST_STEPS:
            steps += 1
            across = project(Q, normal, d, w, count)
            solve_triangular(R, d, r, count)
            first, blocking = np.inf, -1
            for c in range(count):
                if r[c] > 0.0 and lower[active[c]] < upper[active[c]] and u[c] < first * r[c]:
                    first, blocking = max(u[c], 0.0) / r[c], c
            missing = bound - dot(normal, z, n)
            depends = across <= _DEPENDENT**2 * size or count == most
            full = np.inf if depends else missing / across
            if depends and blocking < 0:
                if missing > _ROUNDING:
                    return x, np.zeros(rows), np.inf, _CONTRADICTION, count
                seen[p] = 2
                break
            step = min(first, full)
            for c in range(count):
                u[c] -= step * r[c]
            own += step
            if not depends:
                for i in range(n):
                    z[i] += step * w[i]
            if full <= first:
                length = np.sqrt(across)
                for i in range(n):
                    Q[count, i] = w[i] / length
                for c in range(count):
                    R[c, count] = d[c]
                R[count, count] = length
                active[count], side[count], u[count] = p, sign, own
                count += 1
                break
            let_go(Q, R, active, side, u, blocking, count)
            count -= 1
    multipliers = np.zeros(rows)
    for c in range(count):
        multipliers[active[c]] -= side[c] * u[c]
    return x, multipliers, _residual(H, g, A, lower, upper, x, multipliers), status, count


class ActiveSet:
    """One Hessian and the rows held at the last solution, from which the next QP begins."""

    def __init__(self) -> None:
        self._room(0)

    def _room(self, n: int) -> None:
        self._active, self._side = np.empty(n, np.intp), np.empty(n)
        self._Q, self._R = np.empty((n, n)), np.empty((n, n))
        self._count = 0

    def begin(self, H: Array) -> bool:
        """Factors a Hessian (k, k) and forgets the rows held. False if it is not positive definite."""
        if len(H) != len(self._active):
            self._room(len(H))
        self._H, self._count = H, 0
        try:
            self._L = np.linalg.cholesky(H)
        except np.linalg.LinAlgError:
            return False
        return True

    def solve(self, g: Array, rows: Rows, same: int) -> QPSolution:
        """min ½xᵀHx + gᵀx under the rows; lower = upper is an equality.

        Args:
            g: (k,). rows: of k columns.
            same: how many of the first rows are those of the QP before.
        """
        started = perf_counter_ns()
        held = self._active[: self._count]
        if (held >= same).any():
            self._count = 0
        x, multipliers, residual, status, self._count = _solve(
            *(self._L, self._H, g, np.ascontiguousarray(rows.A), rows.lower, rows.upper),
            *(self._active, self._side, self._count, self._Q, self._R),
        )
        time_us = (perf_counter_ns() - started) / 1e3
        return QPSolution(x, multipliers, residual, _STATUS[status], time_us)

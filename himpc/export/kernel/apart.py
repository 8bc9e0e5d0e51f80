"""Increments of a fallback where rows of distances are violated: `himpc.limits.rest` on arrays."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel, plain
from himpc.export.kernel.rows import constraints_of, joint_rows
from himpc.htmpc.kernel.active_set import solve as solve_qp
from himpc.limits.rest import FAINT
from himpc.tick.kernel.arrays import Array, TickArrays
from himpc.tick.kernel.bounds import constraint_values
from himpc.tick.kernel.pair_arrays import PairArrays

_solve = inline_kernel(plain(solve_qp))


@inline_kernel
def keep_apart(t: TickArrays, d: PairArrays, U: Array) -> None:
    """Changes the first increment of U, (N, n) N·m, as `himpc.limits.rest.kept_apart` does: the violation of
    the rows of distances is minimised by least squares, and rows of joints that U satisfies stay
    satisfied."""
    N, n, R, joints = len(U), U.shape[1], d.chosen.size, joint_rows(t)
    if joints == len(t.L):
        return
    constraint_values(U, constraints_of(t, t.reached))
    d.qp_rows[:], d.qp_hessian[:], d.qp_factor[:] = 0.0, 0.0, 0.0
    d.qp_gradient[:], d.qp_multipliers[:], violated = 0.0, 0.0, False
    for i in range(n + R):
        d.qp_lower[i], d.qp_upper[i], d.qp_rows[i, i] = -math.inf, math.inf, 1.0
        d.qp_hessian[i, i] = FAINT if i < n else 1.0
        d.qp_factor[i, i] = math.sqrt(d.qp_hessian[i, i])
    for row in range(joints + N):
        profile = t.L[row, 0]
        if not profile > 0.0:
            continue
        for c in range(n if row < joints else R):
            i = c if row < joints else n + c
            d.qp_lower[i] = max(d.qp_lower[i], (t.lower[row, c] - t.reached[row, c]) / profile)
            d.qp_upper[i] = min(d.qp_upper[i], (t.upper[row, c] - t.reached[row, c]) / profile)
    for c in range(R):
        violated = violated or d.qp_lower[n + c] > 0.0
        for a in range(n):
            d.qp_rows[n + c, a] = t.direction[0, c, a]
    if not violated:
        return
    for a in range(n):
        d.qp_lower[a], d.qp_upper[a] = min(d.qp_lower[a], 0.0), max(d.qp_upper[a], 0.0)
    _solve(
        *(d.qp_factor, d.qp_hessian, d.qp_gradient, d.qp_rows, d.qp_lower, d.qp_upper, d.qp_held, 0),
        *(d.qp_normals, d.qp_active, d.qp_vectors, d.qp_watched, d.qp_value, d.qp_x, d.qp_multipliers),
    )
    total = 0.0
    for a in range(n):
        total += d.qp_x[a]
    if math.isfinite(total):
        for a in range(n):
            U[0, a] += min(max(d.qp_x[a], d.qp_lower[a]), d.qp_upper[a])

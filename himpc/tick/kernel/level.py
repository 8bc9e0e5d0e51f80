"""One level of the cascade in its own coordinates: the quadratic cost (34a), and its optimum."""

from __future__ import annotations

import math
from typing import NamedTuple

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.active_set import Quadratic
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.linear import dot, factorise, forward
from himpc.tick.kernel.residual import add_effects, effects, gather, gather_effects, hessian


class LevelQP(NamedTuple):
    """The problem min ½ρ‖x‖² + ½ρ‖x'‖² + ½‖e₀ + G x‖², where U_j = fixed_j + metric ∘ Q_j (0, x_j, x'_j).

    A knot has three groups of coordinates, in this order: those of the levels above, which (33) fixes; the
    level's own x, which change its residual; and the others, x', which do not change its residual but may be
    needed for bounds. In the arrays, the own coordinates of all knots come before the others of all knots.

    Attributes:
        first, last: range of the level's rows among the rows of all levels.
        rho: ρ, the weight of the increments.
        accuracy: the largest gradient that the point may have.
        C, S, row_knots: see `residual`.
        B, free, root_Q: Ĵ M̄⁻¹ (N, m, n), e for Δτ = 0 (N, m) and √Q (m,) of all rows.
        projected_jacobian: B in the coordinates of each knot, (N, m, n).
        e_0, e_1: √Q e for x = 0, and at the point, (N, m).
        B_U: scratch, (N, m).
        start: (N,) index of the first own coordinate of a knot among the knot's coordinates.
        offset: (N+1,) index in x of the first own coordinate of a knot.
        rest: (N+1,) index in x of the first other coordinate of a knot; all others come last.
        fixed: (N, n) the part of the increments that (33) fixes, N·m.
        Q, metric: directions (N, n, n), and √(ρ/R) of the joints, (n,).
        cost: the quadratic cost above; F is the Cholesky factor of ρ + GᵀG.
        x: the point: own coordinates, then the others.
        z: scratch.
        slope: the gradient.
        size: ‖G‖, ‖e₀‖: two numbers.
    """

    first: int
    last: int
    rho: float
    accuracy: float
    C: Array
    S: Array
    row_knots: IntArray
    B: Array
    free: Array
    root_Q: Array
    projected_jacobian: Array
    e_0: Array
    e_1: Array
    B_U: Array
    start: IntArray
    offset: IntArray
    rest: IntArray
    fixed: Array
    Q: Array
    metric: Array
    cost: Quadratic
    x: Array
    z: Array
    slope: Array
    size: Array


@inline_kernel
def prepare(level: LevelQP) -> bool:
    """Computes e₀, and the fields F and `ideal` of the cost. Returns False if the Hessian is not positive
    definite, which happens if numbers are not finite."""
    first, last = level.first, level.last
    N = len(level.start)
    total = 0.0
    effects(level.B, level.fixed, first, last, level.B_U)
    for i in range(first, last):
        for k in range(N):
            level.e_0[k, i] = level.root_Q[i] * level.free[k, i] if k < level.row_knots[i] else 0.0
    add_effects(level.C, level.B_U, first, last, level.row_knots, level.e_0)
    for k in range(N):
        total += dot(level.e_0[k, first:last], level.e_0[k, first:last], last - first)
    trace = hessian(
        level.S, level.projected_jacobian, first, last, level.start, level.offset, level.rho, level.cost.F
    )
    level.size[0], level.size[1] = math.sqrt(trace), math.sqrt(total)
    gather_effects(level.C, level.e_0, first, last, level.row_knots, level.B_U)
    gather(level.projected_jacobian, level.B_U, first, last, level.start, level.offset, level.slope)
    d = level.cost.d
    if not factorise(level.cost.F, d):
        return False
    for c in range(d):
        level.cost.ideal[c] = -level.slope[c]
    forward(level.cost.F, level.cost.ideal, d)
    return True


@inline_kernel
def increments(level: LevelQP, U: Array) -> None:
    """Computes U_j = fixed_j + metric ∘ Q_j (0, x_j, x'_j), (N, n) N·m."""
    N, n = U.shape
    for j in range(N):
        mine, others = level.offset[j + 1] - level.offset[j], level.rest[j + 1] - level.rest[j]
        start = level.start[j]
        for a in range(n):
            row = level.Q[j, a, start:]
            total = dot(row, level.x[level.offset[j] :], mine)
            total += dot(row[mine:], level.x[level.rest[j] :], others)
            U[j, a] = level.fixed[j, a] + level.metric[a] * total

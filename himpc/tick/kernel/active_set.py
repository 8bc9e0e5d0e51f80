"""Rows taken as equalities: an orthonormal account of them, their multipliers, and the point they hold."""

from __future__ import annotations

import math
from typing import NamedTuple

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.arrays import Array, Whole
from himpc.tick.kernel.bounds import LevelBounds
from himpc.tick.kernel.level import LevelQP
from himpc.tick.kernel.linear import backward, close_gap, copy, dot, forward, split, subtract
from himpc.tick.kernel.residual import add_effects, apply, gather, gather_effects

_DEPENDENT = 1e-10
"""A row of which less than this share is new depends on those taken before."""
_ROUNDS = 4
"""The normal equations lose digits on long horizons; refinement brings them back."""
_ROUNDING = 2e-14
"""A gradient below this share of ‖G‖‖e‖ is rounding: no better point can be told from this one."""
_MET = 1e-11
"""N·m: how exactly rows that are taken as equalities are met."""
_WORTH = 1e-8
"""What the cost may gain by what they are missed by."""


class ActiveSet(NamedTuple):
    """Rows a'x ≤ b that hold the point as equalities, k of room for many.

    Attributes:
        row, joint, side: which they are, and whether the upper (1) or the lower bound (−1).
        normal: their a, in the coordinates of `LevelQP`.
        scaled_normal: the same where the Hessian is one: F⁻¹ a, a'/√ρ.
        orthonormal_basis, cholesky_factor: orthonormal rows, and the lower triangle of
            scaled_normal = cholesky_factor · orthonormal_basis.
        target: their b.
        multiplier: their multipliers.
        violation: by how much the point misses them.
        change: scratch.
    """

    row: Whole
    joint: Whole
    side: Whole
    normal: Array
    scaled_normal: Array
    orthonormal_basis: Array
    cholesky_factor: Array
    target: Array
    multiplier: Array
    violation: Array
    change: Array


@inline_kernel
def directed_normal(level: LevelQP, weights: Array, along: Array, normal: Array) -> float:
    """Coefficients of a row with its own direction, into `normal`; returns what the levels above make of it.

    Args:
        level: gives the coordinates.
        weights: the row's time profile, (N,).
        along: its direction, (n,).
        normal: the result.
    """
    n, before = along.size, 0.0
    for j in range(len(level.start)):
        start = level.start[j]
        mine, others = level.offset[j + 1] - level.offset[j], level.rest[j + 1] - level.rest[j]
        for c in range(mine + others):
            total = 0.0
            for a in range(n):
                total += along[a] * level.metric[a] * level.Q[j, a, start + c]
            place = level.offset[j] + c if c < mine else level.rest[j] + c - mine
            normal[place] = weights[j] * total
        before += weights[j] * dot(along, level.fixed[j], n)
    return before


@inline_kernel
def normal_of(level: LevelQP, active: ActiveSet, index: int, bounds: LevelBounds) -> None:
    """Coefficients, scaled coefficients and target of row `index`."""
    r, a = active.row[index], active.joint[index]
    normal, scaled_normal = active.normal[index], active.scaled_normal[index]
    N = len(level.start)
    L, limit = bounds.L, bounds.high[r, a] if active.side[index] > 0 else bounds.low[r, a]
    if r >= bounds.plain:
        along = bounds.direction[(r - bounds.plain) // N, a]
        limit -= directed_normal(level, L[r], along, normal)
    else:
        for j in range(N):
            limit -= L[r, j] * level.fixed[j, a]
            weight = L[r, j] * level.metric[a]
            start = level.start[j]
            mine, others = level.offset[j + 1] - level.offset[j], level.rest[j + 1] - level.rest[j]
            for c in range(mine):
                normal[level.offset[j] + c] = weight * level.Q[j, a, start + c]
            for c in range(others):
                normal[level.rest[j] + c] = weight * level.Q[j, a, start + mine + c]
    active.target[index] = limit
    d, D = level.offset[N], level.rest[N]
    for c in range(d):
        scaled_normal[c] = normal[c]
    forward(level.F, scaled_normal, d)
    share = 1.0 / math.sqrt(level.rho)
    for c in range(d, D):
        scaled_normal[c] = share * normal[c]


@inline_kernel
def resolve(active: ActiveSet, index: int, D: int, budget: Array) -> float:
    """Row `index` in terms of those before it: its coefficients go into `cholesky_factor`, the new
    direction into `orthonormal_basis`, not yet of length one. Returns the length of what is new, 0 if the row
    depends on the others."""
    budget[0] -= 4.0 * D * (index + 1.0)
    scaled_normal = active.scaled_normal[index]
    left = split(
        scaled_normal,
        active.orthonormal_basis,
        index,
        D,
        active.cholesky_factor[index],
        active.orthonormal_basis[index],
        1.0,
    )
    length, whole = math.sqrt(left), math.sqrt(dot(scaled_normal, scaled_normal, D))
    return length if length > _DEPENDENT * whole and length > 1e-14 else 0.0


@inline_kernel
def fix(active: ActiveSet, index: int, length: float, D: int) -> None:
    """Makes what `resolve` found for row `index` part of the orthonormal rows."""
    active.cholesky_factor[index, index] = length
    for c in range(D):
        active.orthonormal_basis[index, c] /= length


@inline_kernel
def move(active: ActiveSet, source: int, to: int, D: int) -> None:
    """Copies a row to another place."""
    active.row[to], active.joint[to], active.side[to] = (
        active.row[source],
        active.joint[source],
        active.side[source],
    )
    active.target[to], active.multiplier[to] = active.target[source], active.multiplier[source]
    copy(active.normal[source], active.normal[to], D)
    copy(active.scaled_normal[source], active.scaled_normal[to], D)


@inline_kernel
def without(active: ActiveSet, index: int, k: int, D: int, budget: Array) -> None:
    """Lets row `index` of k go; those behind it move up, and rotations make `cholesky_factor` triangular."""
    budget[0] -= 6.0 * D * (k - index)
    for p in range(index, k - 1):
        move(active, p + 1, p, D)
    close_gap(active.cholesky_factor, active.orthonormal_basis, index, k, D)


@inline_kernel
def update_multipliers(level: LevelQP, active: ActiveSet, k: int) -> None:
    """Multipliers of k rows as equalities."""
    d = level.offset[len(level.start)]
    for p in range(k):
        active.multiplier[p] = dot(active.scaled_normal[p], level.ideal, d) - active.target[p]
    forward(active.cholesky_factor, active.multiplier, k)
    backward(active.cholesky_factor, active.multiplier, k)


@inline_kernel
def point_from_multipliers(level: LevelQP, active: ActiveSet, k: int) -> None:
    """The point that belongs to the multipliers of k rows."""
    N = len(level.start)
    d, D = level.offset[N], level.rest[N]
    x = level.x
    for c in range(D):
        x[c] = level.ideal[c] if c < d else 0.0
    for p in range(k):
        subtract(active.multiplier[p], active.scaled_normal[p], x, D)
    backward(level.F, x, d)
    share = 1.0 / math.sqrt(level.rho)
    for c in range(d, D):
        x[c] *= share


@inline_kernel
def refine(level: LevelQP, active: ActiveSet, k: int) -> float:
    """The optimum with the first k rows as equalities, from a point and multipliers near it. Returns its KKT
    residual, −1 if there is none within reach.

    Iterative refinement: the conditions are evaluated afresh and the factors correct what they miss.
    """
    first, last, rho = level.first, level.last, level.rho
    N = len(level.start)
    d, D = level.offset[N], level.rest[N]
    x, z, slope = level.x, level.z, level.slope
    gradient, violation, worth, share = math.inf, math.inf, math.inf, 1.0 / math.sqrt(rho)
    for attempt in range(_ROUNDS + 1):
        apply(level.projected_jacobian, x, first, last, level.start, level.offset, level.pushed)
        for j in range(N):
            for i in range(first, last):
                level.e_1[j, i] = level.e_0[j, i]
        add_effects(level.C, level.pushed, first, last, level.row_knots, level.e_1)
        gather_effects(level.C, level.e_1, first, last, level.row_knots, level.pushed)
        gather(level.projected_jacobian, level.pushed, first, last, level.start, level.offset, slope)
        for c in range(d, D):
            slope[c] = 0.0
        subtract(-rho, x, slope, D)
        violation = worth = 0.0
        for p in range(k):
            subtract(-active.multiplier[p], active.normal[p], slope, D)
            active.violation[p] = dot(active.normal[p], x, D) - active.target[p]
            violation, worth = (
                max(violation, abs(active.violation[p])),
                max(worth, abs(active.multiplier[p] * active.violation[p])),
            )
        gradient = math.sqrt(dot(slope, slope, D))
        met = violation <= _MET and worth <= _WORTH
        if met and gradient <= level.accuracy:
            return gradient
        if met and gradient <= _ROUNDING * level.size[0] * level.size[1]:
            break
        if attempt == _ROUNDS:
            break
        for c in range(D):
            z[c] = -slope[c] if c < d else -share * slope[c]
        forward(level.F, z, d)
        for p in range(k):
            active.change[p] = dot(active.scaled_normal[p], z, D) + active.violation[p]
        forward(active.cholesky_factor, active.change, k)
        backward(active.cholesky_factor, active.change, k)
        for p in range(k):
            subtract(active.change[p], active.scaled_normal[p], z, D)
            active.multiplier[p] += active.change[p]
        backward(level.F, z, d)
        for c in range(D):
            x[c] += z[c] if c < d else share * z[c]
    scale = max(1.0, (rho + level.size[0] * level.size[0]) * math.sqrt(dot(x, x, d)))
    scale = max(scale, level.size[0] * level.size[1])
    residual = max(gradient / scale, violation)
    return residual if residual <= 1e-6 else -1.0

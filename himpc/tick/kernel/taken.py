"""Rows taken as equalities: an orthonormal account of them, their multipliers, and the point they hold."""

from __future__ import annotations

import math
from typing import NamedTuple

from himpc.compilation.compiled import piece
from himpc.tick.kernel.arena import Array, Whole
from himpc.tick.kernel.level import Level
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


class Taken(NamedTuple):
    """Rows a'x ≤ b that hold the point as equalities, k of room for many.

    Attributes:
        row, joint, side: which they are, and whether the upper (1) or the lower bound (−1).
        normal: their a, in the coordinates of `Level`.
        white: the same where the Hessian is one: F⁻¹ a, a'/√ρ.
        basis, corner: orthonormal rows and the lower triangle, white = corner · basis.
        target: their b.
        pull: their multipliers.
        lost: by how much the point misses them.
        change: scratch.
    """

    row: Whole
    joint: Whole
    side: Whole
    normal: Array
    white: Array
    basis: Array
    corner: Array
    target: Array
    pull: Array
    lost: Array
    change: Array


@piece
def normal_of(level: Level, taken: Taken, place: int, L: Array, low: Array, high: Array) -> None:
    """Coefficients, white coefficients and target of row `place`."""
    r, a = taken.row[place], taken.joint[place]
    normal, white = taken.normal[place], taken.white[place]
    N = len(level.start)
    limit = high[r, a] if taken.side[place] > 0 else low[r, a]
    for j in range(N):
        limit -= L[r, j] * level.fixed[j, a]
        weight = L[r, j] * level.metric[a]
        start = level.start[j]
        mine, others = level.offset[j + 1] - level.offset[j], level.rest[j + 1] - level.rest[j]
        for c in range(mine):
            normal[level.offset[j] + c] = weight * level.Q[j, a, start + c]
        for c in range(others):
            normal[level.rest[j] + c] = weight * level.Q[j, a, start + mine + c]
    taken.target[place] = limit
    d, D = level.offset[N], level.rest[N]
    for c in range(d):
        white[c] = normal[c]
    forward(level.F, white, d)
    share = 1.0 / math.sqrt(level.rho)
    for c in range(d, D):
        white[c] = share * normal[c]


@piece
def resolve(taken: Taken, place: int, D: int, budget: Array) -> float:
    """Row `place` in terms of those before it: its coefficients into `corner`, the direction that is new into
    `basis`, not yet of length one. Returns the length of what is new, 0 if the row depends on the others."""
    budget[0] -= 4.0 * D * (place + 1.0)
    white = taken.white[place]
    left = split(white, taken.basis, place, D, taken.corner[place], taken.basis[place], 1.0)
    length, whole = math.sqrt(left), math.sqrt(dot(white, white, D))
    return length if length > _DEPENDENT * whole and length > 1e-14 else 0.0


@piece
def fix(taken: Taken, place: int, length: float, D: int) -> None:
    """Makes what `resolve` found for row `place` part of the orthonormal rows."""
    taken.corner[place, place] = length
    for c in range(D):
        taken.basis[place, c] /= length


@piece
def move(taken: Taken, source: int, to: int, D: int) -> None:
    """Copies a row to another place."""
    taken.row[to], taken.joint[to], taken.side[to] = (
        taken.row[source],
        taken.joint[source],
        taken.side[source],
    )
    taken.target[to], taken.pull[to] = taken.target[source], taken.pull[source]
    copy(taken.normal[source], taken.normal[to], D)
    copy(taken.white[source], taken.white[to], D)


@piece
def without(taken: Taken, place: int, k: int, D: int, budget: Array) -> None:
    """Lets row `place` of k go; those behind it move up, and rotations make `corner` triangular again."""
    budget[0] -= 6.0 * D * (k - place)
    for p in range(place, k - 1):
        move(taken, p + 1, p, D)
    close_gap(taken.corner, taken.basis, place, k, D)


@piece
def balance(level: Level, taken: Taken, k: int, ideal: Array) -> None:
    """Multipliers of k rows as equalities; `ideal` is the white point without any row."""
    d = level.offset[len(level.start)]
    for p in range(k):
        taken.pull[p] = dot(taken.white[p], ideal, d) - taken.target[p]
    forward(taken.corner, taken.pull, k)
    backward(taken.corner, taken.pull, k)


@piece
def settle(level: Level, taken: Taken, k: int, ideal: Array) -> None:
    """The point that belongs to the multipliers of k rows."""
    N = len(level.start)
    d, D = level.offset[N], level.rest[N]
    x = level.x
    for c in range(D):
        x[c] = ideal[c] if c < d else 0.0
    for p in range(k):
        subtract(taken.pull[p], taken.white[p], x, D)
    backward(level.F, x, d)
    share = 1.0 / math.sqrt(level.rho)
    for c in range(d, D):
        x[c] *= share


@piece
def refine(level: Level, taken: Taken, k: int) -> float:
    """The optimum with the first k rows as equalities, from a point and multipliers near it. Returns its KKT
    residual, −1 if there is none within reach.

    Iterative refinement: the conditions are evaluated afresh and the factors correct what they miss.
    """
    first, last, rho = level.first, level.last, level.rho
    N = len(level.start)
    d, D = level.offset[N], level.rest[N]
    x, z, slope = level.x, level.z, level.slope
    gradient, lost, worth, share = math.inf, math.inf, math.inf, 1.0 / math.sqrt(rho)
    for attempt in range(_ROUNDS + 1):
        apply(level.seen, x, first, last, level.start, level.offset, level.pushed)
        for j in range(N):
            for i in range(first, last):
                level.e_1[j, i] = level.e_0[j, i]
        add_effects(level.C, level.pushed, first, last, level.row_knots, level.e_1)
        gather_effects(level.C, level.e_1, first, last, level.row_knots, level.pushed)
        gather(level.seen, level.pushed, first, last, level.start, level.offset, slope)
        for c in range(d, D):
            slope[c] = 0.0
        subtract(-rho, x, slope, D)
        lost = worth = 0.0
        for p in range(k):
            subtract(-taken.pull[p], taken.normal[p], slope, D)
            taken.lost[p] = dot(taken.normal[p], x, D) - taken.target[p]
            lost, worth = max(lost, abs(taken.lost[p])), max(worth, abs(taken.pull[p] * taken.lost[p]))
        gradient = math.sqrt(dot(slope, slope, D))
        met = lost <= _MET and worth <= _WORTH
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
            taken.change[p] = dot(taken.white[p], z, D) + taken.lost[p]
        forward(taken.corner, taken.change, k)
        backward(taken.corner, taken.change, k)
        for p in range(k):
            subtract(taken.change[p], taken.white[p], z, D)
            taken.pull[p] += taken.change[p]
        backward(level.F, z, d)
        for c in range(D):
            x[c] += z[c] if c < d else share * z[c]
    scale = max(1.0, (rho + level.size[0] * level.size[0]) * math.sqrt(dot(x, x, d)))
    scale = max(scale, level.size[0] * level.size[1])
    residual = max(gradient / scale, lost)
    return residual if residual <= 1e-6 else -1.0

"""The rows of bounds of a level: their coefficients, their lengths, and the choice of the next violated
row."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.active_set import ActiveSet, scale
from himpc.tick.kernel.arrays import Array
from himpc.tick.kernel.bounds import LevelBounds
from himpc.tick.kernel.level import LevelQP
from himpc.tick.kernel.linear import dot, forward, subtract

_SHORT = 1e-9
"""Share of the longest row: a shorter row is treated as if it had this length."""


@inline_kernel
def directed_normal(level: LevelQP, weights: Array, along: Array, normal: Array) -> float:
    """Writes the coefficients of a row with its own direction to `normal`; returns the row's value under the
    increments that the levels above fix.

    Args:
        level: determines the coordinates.
        weights: the row's time profile, (N,).
        along: the row's direction, (n,).
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
            coordinate = level.offset[j] + c if c < mine else level.rest[j] + c - mine
            normal[coordinate] = weights[j] * total
        before += weights[j] * dot(along, level.fixed[j], n)
    return before


@inline_kernel
def normal_of(level: LevelQP, active: ActiveSet, index: int, bounds: LevelBounds) -> None:
    """Computes the coefficients, scaled coefficients and target of row `index`."""
    r, a = active.row[index], active.joint[index]
    normal = active.normal[index]
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
    scale(level.cost, normal, active.scaled_normal[index])


@inline_kernel
def lengths(level: LevelQP, active: ActiveSet, k: int, bounds: LevelBounds, budget: Array) -> None:
    """Writes the lengths of the scaled coefficients of all rows to `bounds.length`; row k of `active` is
    scratch."""
    N, n = level.fixed.shape
    d, D, share = level.cost.d, level.cost.D, level.cost.share
    length, plain = bounds.length, bounds.plain
    kinds = plain // N
    budget[0] -= N * n * (d * d / 6.0 + 8.0 * D)
    one, torque, velocity, position = active.scaled_normal[k], level.x, level.slope, active.change
    longest = 0.0
    for a in range(n):
        for c in range(D):
            torque[c] = velocity[c] = position[c] = 0.0
        for j in range(N):
            start = level.start[j]
            mine, others = level.offset[j + 1] - level.offset[j], level.rest[j + 1] - level.rest[j]
            for c in range(D):
                one[c] = 0.0
            for c in range(mine):
                one[level.offset[j] + c] = level.metric[a] * level.Q[j, a, start + c]
            for c in range(others):
                one[level.rest[j] + c] = share * level.metric[a] * level.Q[j, a, start + mine + c]
            forward(level.cost.F, one, d)
            if kinds > 2:
                subtract(-1.0, velocity, position, D)
                length[2 * N + j, a] = math.sqrt(dot(position, position, D))
            subtract(-1.0, one, torque, D)
            subtract(-1.0, torque, velocity, D)
            length[j, a] = math.sqrt(dot(torque, torque, D))
            if kinds > 1:
                length[N + j, a] = math.sqrt(dot(velocity, velocity, D))
                longest = max(longest, length[N + j, a])
    for r in range(plain, len(length)):
        for a in range(n):
            budget[0] -= n * D + 0.5 * d * d
            directed_normal(level, bounds.L[r], bounds.direction[(r - plain) // N, a], one)
            scale(level.cost, one, one)
            length[r, a] = math.sqrt(dot(one, one, D))
            longest = max(longest, length[r, a])
    for r in range(len(length)):
        for a in range(n):
            length[r, a] = max(length[r, a], _SHORT * longest)


@inline_kernel
def most_violated(value: Array, low: Array, high: Array) -> tuple[float, int, int, int]:
    """Returns the most violated row: violation, row, joint and side. NaN counts as violated."""
    most, row, joint, side = 0.0, -1, -1, 0
    for r in range(len(value)):
        for a in range(value.shape[1]):
            above, below = value[r, a] - high[r, a], low[r, a] - value[r, a]
            if above > most:
                most, row, joint, side = above, r, a, 1
            if below > most:
                most, row, joint, side = below, r, a, -1
            if value[r, a] != value[r, a]:
                return math.inf, r, a, 1
    return most, row, joint, side


@inline_kernel
def farthest(
    value: Array, low: Array, high: Array, length: Array, least: float
) -> tuple[float, int, int, int]:
    """Returns the row whose bound is farthest from the point, among the rows that are violated by more than
    `least`. The result has the form of `most_violated`."""
    most, excess, row, joint, side = 0.0, 0.0, -1, -1, 0
    for r in range(len(value)):
        for a in range(value.shape[1]):
            above, below = value[r, a] - high[r, a], low[r, a] - value[r, a]
            over = max(above, below)
            if over > least and over > most * length[r, a]:
                most, excess, row, joint = over / length[r, a], over, r, a
                side = 1 if above > below else -1
            if value[r, a] != value[r, a]:
                return math.inf, r, a, 1
    return excess, row, joint, side

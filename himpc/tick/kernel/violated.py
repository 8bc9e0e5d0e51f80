"""Which violated row comes next."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.active_set import ActiveSet, directed_normal
from himpc.tick.kernel.arrays import Array
from himpc.tick.kernel.bounds import LevelBounds
from himpc.tick.kernel.level import LevelQP
from himpc.tick.kernel.linear import dot, forward, subtract

_SHORT = 1e-9
"""Share of the longest row: a shorter one is as far away as one of this length."""


@inline_kernel
def most_violated(value: Array, low: Array, high: Array) -> tuple[float, int, int, int]:
    """The row that is violated most: by how much, row, joint and side. What is not a number is violated."""
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
    """The row, violated by more than `least`, to which it is farthest; returns what `most_violated` does."""
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


@inline_kernel
def lengths(level: LevelQP, active: ActiveSet, k: int, bounds: LevelBounds, budget: Array) -> None:
    """How long the white coefficients of all rows are, into `bounds.length`; behind `k` rows there is room to
    work."""
    N, n = level.fixed.shape
    d, D = level.offset[N], level.rest[N]
    length, plain = bounds.length, bounds.plain
    kinds = plain // N
    budget[0] -= N * n * (d * d / 6.0 + 8.0 * D)
    one, torque, velocity, position = active.scaled_normal[k], level.z, level.slope, active.change
    share, longest = 1.0 / math.sqrt(level.rho), 0.0
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
            forward(level.F, one, d)
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
            forward(level.F, one, d)
            for c in range(d, D):
                one[c] *= share
            length[r, a] = math.sqrt(dot(one, one, D))
            longest = max(longest, length[r, a])
    for r in range(len(length)):
        for a in range(n):
            length[r, a] = max(length[r, a], _SHORT * longest)

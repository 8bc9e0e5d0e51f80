"""Solves one level of the cascade."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import always_inline_kernel, inline_kernel
from himpc.tick.kernel.active_set import ActiveSet, Quadratic
from himpc.tick.kernel.arrays import DIRECTED, IntArray, TickArrays, arrays_of
from himpc.tick.kernel.bounds import LevelBounds
from himpc.tick.kernel.cascade import (
    ALONE,
    FIRST,
    KNOTS,
    LAST,
    count_coordinates,
    own_directions,
    prepare_bounds,
)
from himpc.tick.kernel.level import LevelQP, prepare
from himpc.tick.kernel.optimum import FAILED, optimum, warm_start

_SHARE = 0.75
"""Share of the remaining budget that one attempt at a level may use. The rest is left for lower levels; the
last level may use all."""


@always_inline_kernel
def active_set_of(t: TickArrays) -> ActiveSet:
    """Returns scratch arrays for the active rows of a level."""
    return ActiveSet(
        *(t.held_row, t.held_joint, t.held_side, t.normal, t.scaled_normal, t.orthonormal_basis),
        *(t.cholesky_factor, t.target, t.trial_multiplier, t.violation, t.change),
    )


@always_inline_kernel
def level_of(t: TickArrays, i: int) -> LevelQP:
    """Returns level i with its scratch arrays; `count_coordinates` must have been called."""
    cost = Quadratic(t.H, t.ideal, 1.0 / math.sqrt(t.rho[i]), t.offset[-1], t.rest[-1])
    return LevelQP(
        *(t.level[i, FIRST], t.level[i, LAST], t.rho[i], t.accuracy[i], t.C, t.S, t.row_knots),
        *(t.B, t.free, t.root_Q, t.projected_jacobian, t.e_0, t.e_1, t.B_U, t.start, t.offset),
        *(t.rest, t.fixed, t.Q, t.metric[i], cost, t.x, t.z, t.slope, t.size),
    )


@inline_kernel
def solve_level(
    data: Any, where: IntArray, whole: IntArray, whole_where: IntArray, i: int, room: float
) -> bool:
    """Solves Problem i of the cascade after the problems above it; returns False if no optimum was found
    within the remaining budget of the tick.

    room: N·m by which bounds are widened if U_{i−1} is almost the only feasible point. It is positive only
    for a second attempt at a level. The second attempt uses the directions of the first one.
    """
    t = arrays_of(data, where, whole, whole_where)
    levels = t.level
    plain = len(t.L) - t.sizes[DIRECTED] * len(t.start)
    bounds = LevelBounds(t.L, t.low, t.high, t.reached, t.length, t.direction, plain)
    if not room > 0.0:
        own_directions(i, levels, t.B, t.metric[i], t.reflector, t.Q, t.projected_jacobian, t.end, t.start)
        t.left[i] = count_coordinates(levels[i, KNOTS], t.q.size, t.end, t.start, t.offset, t.rest)
    level, active = level_of(t, i), active_set_of(t)
    granted = t.budget[0]
    spared = 0.0 if i == len(levels) - 1 or levels[i, ALONE] else (1.0 - _SHARE) * granted
    t.budget[0] = granted - spared
    kkt, held = 0.0, 0
    if prepare_bounds(i, levels, level, bounds, t.lower, t.upper, t.U, room):
        kkt = FAILED
        if prepare(level):
            row, joint, multiplier = t.warm_row[i], t.warm_joint[i], t.warm_multiplier[i]
            held = warm_start(level, active, bounds, t.warm_count[i], row, joint, multiplier, t.budget)
            kkt, held = optimum(level, active, bounds, held, t.U[i], t.budget)
    t.budget[0] += spared
    if kkt == FAILED:
        # The next attempt, in this tick or the next one, begins with the active rows of this attempt.
        t.warm_count[i] = held
        for p in range(held):
            t.warm_row[i, p], t.warm_joint[i, p] = active.row[p], active.joint[p]
            t.warm_multiplier[i, p] = active.multiplier[p]
        return False
    t.kkt[i], t.active_count[i] = kkt, held
    for p in range(held):
        row, joint = active.row[p], active.joint[p]
        t.active_row[i, p], t.active_joint[i, p], t.multiplier[i, p] = row, joint, active.multiplier[p]
        t.slack[i, p] = (
            t.high[row, joint] - t.reached[row, joint]
            if active.side[p] > 0
            else t.reached[row, joint] - t.low[row, joint]
        )
    return True

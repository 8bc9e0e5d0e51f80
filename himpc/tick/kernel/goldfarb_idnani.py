"""The dual active-set method of Goldfarb and Idnani (1983) for one level, from the rows of the tick before.

The method keeps a point that is optimal under the rows taken so far, as equalities whose multipliers push the
right way, and takes one violated row after the other; the cost only grows, so no set comes twice and it ends.
A row that depends on those taken replaces the one it relieves.
"""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.active_set import (
    ActiveSet,
    fix,
    move,
    normal_of,
    point_from_multipliers,
    refine,
    resolve,
    update_multipliers,
    without,
)
from himpc.tick.kernel.arrays import Array, Whole
from himpc.tick.kernel.bounds import LevelBounds, constraint_values
from himpc.tick.kernel.level import LevelQP, increments
from himpc.tick.kernel.linear import backward
from himpc.tick.kernel.violated import farthest, lengths, most_violated

TOLERANCE = 1e-9
"""N·m: a row violated by less counts as met."""
_NOISE = 1e-12
"""Multipliers that change by less than this share of the one that changes most do not change."""
_ROUNDED = 1e-7
"""N·m: a row that nothing can move any more and that is violated by less is met, up to rounding."""

_ROUGH = 1e-6
"""N·m: a point that is not refined may seem to miss a row by as much. Where many rows meet, rows taken for
that come and go, the same ones again and again, until the budget is spent."""
_MANY = 12
"""Rows taken in one attempt from which on it pays to know how far away each violated row is: whoever goes for
the farthest takes fewer in all than whoever goes for the one that is missed by most newton metres."""
_HARD = 0.5
"""Share of the hardest pull from which a row is let go together with that one."""

FAILED = -1.0


@inline_kernel
def warm_start(
    level: LevelQP,
    active: ActiveSet,
    bounds: LevelBounds,
    count: int,
    row: Whole,
    joint: Whole,
    multiplier: Array,
    budget: Array,
) -> int:
    """Takes the rows that pressed a tick ago, but for those that depend on others; returns how many."""
    d, D = level.offset[len(level.start)], level.rest[len(level.start)]
    enough = 0.5 * budget[0]
    k = 0
    for p in range(count):
        active.row[k], active.joint[k] = row[p], joint[p]
        active.side[k] = 1 if multiplier[p] > 0.0 else -1
        bound = (bounds.high if multiplier[p] > 0.0 else bounds.low)[row[p], joint[p]]
        if k >= D or not math.isfinite(bound) or budget[0] < enough:
            continue
        normal_of(level, active, k, bounds)
        budget[0] -= 0.5 * d * d
        length = resolve(active, k, D, budget)
        if length > 0.0:
            fix(active, k, length, D)
            k += 1
    return k


@inline_kernel
def release(level: LevelQP, active: ActiveSet, k: int, budget: Array) -> int:
    """Lets rows go until the multipliers of all that stay push the right way; returns how many stay.

    Those that pull hardest go first: where a row goes, the multipliers of its neighbours often turn, and rows
    that all go at once have to be taken again one by one.
    """
    d, D = level.offset[len(level.start)], level.rest[len(level.start)]
    while True:
        wrong = -1.0
        for p in range(k):
            wrong = max(wrong, -active.multiplier[p] * active.side[p])
        kept = k
        for p in range(k - 1, -1, -1):
            push = active.multiplier[p] * active.side[p]
            if not push > 0.0 and not push > -_HARD * wrong:
                without(active, p, kept, D, budget)
                kept -= 1
        if kept == k:
            return k
        k = kept
        budget[0] -= k * (d + float(k))
        update_multipliers(level, active, k)


@inline_kernel
def take(level: LevelQP, active: ActiveSet, k: int, excess: float, budget: Array) -> tuple[bool, int]:
    """Takes the row at place k, violated by `excess`, as an equality: the dual step. Returns whether a point
    meets this row and the others, within the budget, and how many rows are taken then."""
    D = level.rest[len(level.start)]
    side = float(active.side[k])
    active.multiplier[k] = 0.0
    length = resolve(active, k, D, budget)
    if length > 0.0:
        fix(active, k, length, D)
    while True:
        budget[0] -= float(k) * k
        change = active.change
        for q in range(k):
            change[q] = active.cholesky_factor[k, q]
        backward(active.cholesky_factor, change, k)
        # How far until the first multiplier is used up, and how far until the row is met.
        first, reach, noise = -1, math.inf, 0.0
        for q in range(k):
            noise = max(noise, _NOISE * abs(change[q]))
        for q in range(k):
            rate = side * change[q] * active.side[q]
            if rate > noise:
                far = active.multiplier[q] * active.side[q] / rate
                if far < reach:
                    first, reach = q, far
        whole = excess / (length * length) if length > 0.0 else math.inf
        step = min(reach, whole)
        if not step < math.inf or budget[0] < 0.0:
            return False, k
        for q in range(k):
            active.multiplier[q] -= step * side * change[q]
        active.multiplier[k] += step * side
        if whole <= reach:
            return True, k + 1
        excess -= step * length * length
        active.multiplier[first] = 0.0
        if length > 0.0:
            # The rotations that close the gap turn this row, too: nothing has to be resolved anew.
            without(active, first, k + 1, D, budget)
            k -= 1
            length = active.cholesky_factor[k, k]
        else:
            without(active, first, k, D, budget)
            move(active, k, k - 1, D)
            k -= 1
            length = resolve(active, k, D, budget)
            if length > 0.0:
                fix(active, k, length, D)


@inline_kernel
def optimum(
    level: LevelQP, active: ActiveSet, bounds: LevelBounds, k: int, U: Array, budget: Array
) -> tuple[float, int]:
    """The level's optimum under its bounds: its KKT residual and how many rows hold it; FAILED if none was
    found, and how many rows it got to within the budget, 0 if more of it would be of no help.

    Args:
        level: prepared.
        active: the k rows to begin with, from `warm_start`; holds the active rows and their multipliers
            afterwards.
        bounds: gives way by rounding where nothing else can.
        U: the increments found, (N, n).
        budget: how many multiplications are left, one number: time, but the same on every machine.
    """
    low, high, value = bounds.low, bounds.high, bounds.value
    N = len(level.start)
    d, D = level.offset[N], level.rest[N]
    evaluation_cost = float(d * d + U.size * U.shape[1] + 4 * value.size)
    evaluation_cost += float((len(value) - bounds.plain) * U.shape[1] * (N + U.shape[1]))
    update_multipliers(level, active, k)
    k = release(level, active, k, budget)
    point_from_multipliers(level, active, k)
    changes = 0
    while True:
        budget[0] -= 3.0 * evaluation_cost + 4.0 * k * D
        kkt = refine(level, active, k)
        if budget[0] < 0.0:
            return FAILED, k
        if kkt < 0.0:
            return FAILED, 0
        kept = release(level, active, k, budget)
        if kept < k:
            k = kept
            point_from_multipliers(level, active, k)
            continue
        increments(level, U)
        constraint_values(U, bounds)
        excess, r, a, side = most_violated(value, low, high)
        if not excess > TOLERANCE:
            return kkt, k
        exact = True
        while excess > (TOLERANCE if exact else _ROUGH):
            if not excess < math.inf:
                return FAILED, 0
            changes += 1
            if changes == _MANY:
                lengths(level, active, k, bounds, budget)
            if changes >= _MANY:
                excess, r, a, side = farthest(value, low, high, bounds.length, TOLERANCE if exact else _ROUGH)
            active.row[k], active.joint[k], active.side[k] = r, a, side
            budget[0] -= evaluation_cost + 2.0 * k * D
            normal_of(level, active, k, bounds)
            met, k = take(level, active, k, excess, budget)
            if not met:
                if budget[0] < 0.0:
                    return FAILED, k
                if exact and excess > _ROUNDED:
                    return FAILED, 0
                if exact and side > 0:
                    high[r, a] += excess
                elif exact:
                    low[r, a] -= excess
                update_multipliers(level, active, k)
                k = release(level, active, k, budget)
            point_from_multipliers(level, active, k)
            if not met and not exact:
                break  # at a vertex the rounding of a point that is not refined looks like an excess
            increments(level, U)
            constraint_values(U, bounds)
            excess, r, a, side = most_violated(value, low, high)
            exact = False

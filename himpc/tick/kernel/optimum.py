"""Computes the optimum of one level under its bounds by the steps of `goldfarb_idnani`, starting from the
active rows of the previous tick."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.active_set import (
    ActiveSet,
    add_row,
    correct,
    evaluate,
    point_from_multipliers,
    resolve,
    unscale,
    update_multipliers,
)
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.bound_rows import farthest, lengths, most_violated, normal_of
from himpc.tick.kernel.bounds import LevelBounds, constraint_values
from himpc.tick.kernel.goldfarb_idnani import ROUNDED, TOLERANCE, dual_step, release
from himpc.tick.kernel.level import LevelQP, increments
from himpc.tick.kernel.linear import dot, subtract
from himpc.tick.kernel.residual import add_effects, apply, gather, gather_effects

_ROUNDS = 4
"""Largest number of steps of refinement. Refinement corrects rounding errors of the normal equations on long
horizons."""
_ROUNDING = 2e-14
"""A gradient below this share of ‖G‖‖e‖ is a rounding error, and the point counts as optimal."""
_MET = 1e-11
"""N·m: largest accepted violation of an active row."""
_WORTH = 1e-8
"""Largest accepted change of the cost by the violations of the active rows."""
_ROUGH = 1e-6
"""N·m: a smaller violation at a point without refinement may be a rounding error. If such rows were added
near a vertex of many rows, the same rows would be added and removed until the budget is used up."""
_MANY = 12
"""If an attempt adds more rows than this, the next row is the one that is farthest from the point, instead of
the one with the largest violation in N·m. The distances take time, but fewer rows are then needed in
total."""

FAILED = -1.0


@inline_kernel
def warm_start(
    level: LevelQP,
    active: ActiveSet,
    bounds: LevelBounds,
    count: int,
    row: IntArray,
    joint: IntArray,
    multiplier: Array,
    budget: Array,
) -> int:
    """Adds the rows that were active in the previous tick, without linearly dependent ones; returns their
    number."""
    d, D = level.cost.d, level.cost.D
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
            add_row(active, k, length, D)
            k += 1
    return k


@inline_kernel
def refine(level: LevelQP, active: ActiveSet, k: int) -> float:
    """Computes the optimum with the first k rows as equalities, from a point and multipliers near it, by
    iterative refinement: it evaluates the optimality conditions and corrects their residuals with the
    factors. Returns the KKT residual, −1 if the refinement fails.
    """
    first, last, rho = level.first, level.last, level.rho
    N = len(level.start)
    d, D, x, slope = level.cost.d, level.cost.D, level.x, level.slope
    gradient, violation = math.inf, math.inf
    for attempt in range(_ROUNDS + 1):
        apply(level.projected_jacobian, x, first, last, level.start, level.offset, level.B_U)
        for j in range(N):
            for i in range(first, last):
                level.e_1[j, i] = level.e_0[j, i]
        add_effects(level.C, level.B_U, first, last, level.row_knots, level.e_1)
        gather_effects(level.C, level.e_1, first, last, level.row_knots, level.B_U)
        gather(level.projected_jacobian, level.B_U, first, last, level.start, level.offset, slope)
        for c in range(d, D):
            slope[c] = 0.0
        subtract(-rho, x, slope, D)
        violation, worth = evaluate(active, x, k, D, slope)
        gradient = math.sqrt(dot(slope, slope, D))
        met = violation <= _MET and worth <= _WORTH
        if met and gradient <= level.accuracy:
            return gradient
        if met and gradient <= _ROUNDING * level.size[0] * level.size[1]:
            break
        if attempt == _ROUNDS:
            break
        correct(active, level.cost, k, slope, level.z, x)
    scale = max(1.0, (rho + level.size[0] * level.size[0]) * math.sqrt(dot(x, x, d)))
    scale = max(scale, level.size[0] * level.size[1])
    residual = max(gradient / scale, violation)
    return residual if residual <= 1e-6 else -1.0


@inline_kernel
def optimum(
    level: LevelQP,
    active: ActiveSet,
    bounds: LevelBounds,
    k: int,
    U: Array,
    budget: Array,
) -> tuple[float, int]:
    """Computes the level's optimum under its bounds. Returns its KKT residual and the number of active rows.
    Without an optimum it returns FAILED and the number of active rows at the end of the budget, or 0 if a
    larger budget would not help.

    Args:
        level: the level, for which `prepare` has been called.
        active: the k rows to begin with, from `warm_start`. Afterwards it contains the active rows and their
            multipliers.
        bounds: the bounds. A bound that cannot be met because of rounding is widened by its violation.
        U: the increments found, (N, n).
        budget: an array of one number, the number of multiplications that are left. It limits the time, and
            is the same on every machine.
    """
    low, high, value = bounds.low, bounds.high, bounds.value
    N, d, D = len(level.start), level.cost.d, level.cost.D
    evaluation_cost = float(d * d + U.size * U.shape[1] + 4 * value.size)
    evaluation_cost += float((len(value) - bounds.plain) * U.shape[1] * (N + U.shape[1]))
    update_multipliers(active, level.cost, k)
    k = release(active, level.cost, k, budget)
    point_from_multipliers(active, level.cost, k, level.z)
    unscale(level.cost, level.z, level.x)
    changes = 0
    while True:
        budget[0] -= 3.0 * evaluation_cost + 4.0 * k * D
        kkt = refine(level, active, k)
        if budget[0] < 0.0:
            return FAILED, k
        if kkt < 0.0:
            return FAILED, 0
        kept = release(active, level.cost, k, budget)
        if kept < k:
            k = kept
            point_from_multipliers(active, level.cost, k, level.z)
            unscale(level.cost, level.z, level.x)
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
            if exact:
                point_from_multipliers(active, level.cost, k, level.z)
            met, k = dual_step(active, k, excess, level.z, D, budget)
            if not met:
                if budget[0] < 0.0:
                    return FAILED, k
                if exact and excess > ROUNDED:
                    return FAILED, 0
                if exact and side > 0:
                    high[r, a] += excess
                elif exact:
                    low[r, a] -= excess
                update_multipliers(active, level.cost, k)
                k = release(active, level.cost, k, budget)
                point_from_multipliers(active, level.cost, k, level.z)
            unscale(level.cost, level.z, level.x)
            if not met and not exact:
                break  # at a vertex, rounding errors of a point without refinement look like a violation
            increments(level, U)
            constraint_values(U, bounds)
            excess, r, a, side = most_violated(value, low, high)
            exact = False

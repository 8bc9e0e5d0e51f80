"""The steps of the dual active-set method of Goldfarb and Idnani (1983), which HIMPC's levels and HTMPC's QPs
share.

The method keeps a point that is optimal under the active rows, which hold as equalities with multipliers of
the right sign. It adds violated rows one after another. The cost only increases, so that no active set occurs
twice and the method ends. A row that is linearly dependent on the active rows replaces one of them.
"""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.active_set import (
    ActiveSet,
    Quadratic,
    add_row,
    move_row,
    remove_row,
    resolve,
    update_multipliers,
)
from himpc.tick.kernel.arrays import Array
from himpc.tick.kernel.linear import backward, subtract

TOLERANCE = 1e-9
"""A row with a smaller violation counts as satisfied. The unit of this constant and the next one is N·m in
HIMPC, and the unit of the row in HTMPC."""
ROUNDED = 1e-7
"""If no free direction can change a row, a violation of the row that is smaller than this is a rounding
error, and the row counts as satisfied."""
_NOISE = 1e-12
"""A multiplier counts as constant if its change is below this share of the largest change of a multiplier."""
_HARD = 0.5
"""Rows whose multiplier has the wrong sign are removed together if their multipliers exceed this share of the
largest such multiplier."""


@inline_kernel
def release(active: ActiveSet, cost: Quadratic, k: int, budget: Array) -> int:
    """Removes rows until all multipliers have the right sign; returns the number of remaining rows. The rows
    with the largest multipliers of the wrong sign are removed first; then multipliers of neighbouring rows
    often change their sign. If all such rows were removed at once, many would have to be added again.
    """
    while True:
        wrong = -1.0
        for p in range(k):
            wrong = max(wrong, -active.multiplier[p] * active.side[p])
        kept = k
        for p in range(k - 1, -1, -1):
            push = active.multiplier[p] * active.side[p]
            if active.side[p] != 0 and not push > 0.0 and not push > -_HARD * wrong:
                remove_row(active, p, kept, cost.D, budget)
                kept -= 1
        if kept == k:
            return k
        k = kept
        budget[0] -= k * (cost.d + float(k))
        update_multipliers(active, cost, k)


@inline_kernel
def dual_step(active: ActiveSet, k: int, excess: float, z: Array, D: int, budget: Array) -> tuple[bool, int]:
    """Adds the row at index k, whose violation is `excess`, to the active rows. This is the dual step; it
    moves the point z (D,), in scaled coordinates. Returns whether a point that satisfies all these rows was
    found within the budget, and the number of active rows."""
    side = float(active.side[k])
    active.multiplier[k] = 0.0
    length = resolve(active, k, D, budget)
    if length > 0.0:
        add_row(active, k, length, D)
    while True:
        budget[0] -= float(k) * k
        change = active.change
        for q in range(k):
            change[q] = active.cholesky_factor[k, q]
        backward(active.cholesky_factor, change, k)
        # The step to the first zero of a multiplier, and the step at which the row is satisfied.
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
        if length > 0.0:
            subtract(step * side * length, active.orthonormal_basis[k], z, D)
        if whole <= reach:
            return True, k + 1
        excess -= step * length * length
        active.multiplier[first] = 0.0
        if length > 0.0:
            # The rotations that remove row `first` also turn the row that is being
            # added, so `resolve` need not be called again.
            remove_row(active, first, k + 1, D, budget)
            k -= 1
            length = active.cholesky_factor[k, k]
        else:
            remove_row(active, first, k, D, budget)
            move_row(active, k, k - 1, D)
            k -= 1
            length = resolve(active, k, D, budget)
            if length > 0.0:
                add_row(active, k, length, D)

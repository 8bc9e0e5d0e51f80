"""The dual active-set method of Goldfarb and Idnani (1983): its steps, which HIMPC's levels and HTMPC's QPs
share.

The method keeps a point that is optimal under the rows taken so far, as equalities whose multipliers push the
right way, and takes one violated row after the other; the cost only grows, so no set comes twice and it ends.
A row that depends on those taken replaces the one it relieves.
"""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.active_set import ActiveSet, Quadratic, fix, move, resolve, update_multipliers, without
from himpc.tick.kernel.arrays import Array
from himpc.tick.kernel.linear import backward, subtract

TOLERANCE = 1e-9
"""A row violated by less counts as met; like the one below, N·m in HIMPC, in HTMPC the unit of the row."""
ROUNDED = 1e-7
"""A row that nothing can move any more and that is violated by less is met, up to rounding."""
_NOISE = 1e-12
"""Multipliers that change by less than this share of the one that changes most do not change."""
_HARD = 0.5
"""Share of the hardest pull from which a row is let go together with that one."""


@inline_kernel
def release(active: ActiveSet, cost: Quadratic, k: int, budget: Array) -> int:
    """Lets rows go until the multipliers of all that stay push the right way; returns how many stay.

    Those that pull hardest go first: where a row goes, the multipliers of its neighbours often turn, and rows
    that all go at once have to be taken again one by one.
    """
    while True:
        wrong = -1.0
        for p in range(k):
            wrong = max(wrong, -active.multiplier[p] * active.side[p])
        kept = k
        for p in range(k - 1, -1, -1):
            push = active.multiplier[p] * active.side[p]
            if active.side[p] != 0 and not push > 0.0 and not push > -_HARD * wrong:
                without(active, p, kept, cost.D, budget)
                kept -= 1
        if kept == k:
            return k
        k = kept
        budget[0] -= k * (cost.d + float(k))
        update_multipliers(active, cost, k)


@inline_kernel
def take(active: ActiveSet, k: int, excess: float, z: Array, D: int, budget: Array) -> tuple[bool, int]:
    """Takes the row at place k, violated by `excess`, as an equality: the dual step, which moves the point z
    (D,), in scaled coordinates. Returns whether a point meets this row and the others, within the budget, and
    how many rows are taken then."""
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
        if length > 0.0:
            subtract(step * side * length, active.orthonormal_basis[k], z, D)
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

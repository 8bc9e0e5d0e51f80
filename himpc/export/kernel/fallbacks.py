"""The fallbacks of a level without an optimum within its budget: those of `himpc.tick.fallbacks`, but
for the QP of each joint where position rows are imposed as printed."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.export.kernel.braking import braking, missed, soften
from himpc.export.kernel.loop_arrays import LoopArrays
from himpc.export.kernel.rows import constraints_of
from himpc.tick.fallbacks import LEAK
from himpc.tick.kernel.arrays import Array, IntArray, TickArrays
from himpc.tick.kernel.bounds import constraint_values
from himpc.tick.kernel.cascade import ALONE, FIRST, KNOTS, LAST, SOFTENED
from himpc.tick.kernel.control_period import LINEARIZE, NOT_FINITE, perform_parts
from himpc.tick.kernel.evidence import cost_of
from himpc.tick.kernel.goldfarb_idnani import TOLERANCE
from himpc.tick.kernel.linear import copy_rows, dot
from himpc.tick.kernel.pair_arrays import PairArrays
from himpc.tick.kernel.residual import add_effects, effects
from himpc.tick.kernel.solve_level import solve_level

SOLVE, SOFTEN, FEASIBLE, PREVIOUS, INHERIT, BRAKE, HOLD = range(7)
"""The fallbacks that can determine a level's increments, in the order of `himpc.cascade.level.FALLBACKS`."""


@inline_kernel
def period_with_fallbacks(
    t: TickArrays,
    p: LoopArrays,
    d: PairArrays,
    data: Array,
    where: IntArray,
    whole: IntArray,
    whole_where: IntArray,
    parts: int,
) -> int:
    """Performs parts of a control period, see `perform_parts`; a level without an optimum gets a fallback, as
    in `himpc.tick.fallbacks.perform`. Returns the last of the fallbacks that acted, SOLVE if none was needed,
    HOLD if the problems or the torque are not finite."""
    worst, i = SOLVE, 0
    while True:
        reached = perform_parts(data, where, whole, whole_where, parts, i, 0.0)
        if reached == NOT_FINITE:
            return HOLD
        if reached == t.sizes[4]:
            return worst
        fallback = apply_fallback(t, p, d, data, where, whole, whole_where, reached)
        t.fallback[reached] = float(fallback)
        worst = max(worst, fallback)
        parts, i = parts & ~LINEARIZE, reached + 1


@inline_kernel
def apply_fallback(
    t: TickArrays,
    p: LoopArrays,
    d: PairArrays,
    data: Array,
    where: IntArray,
    whole: IntArray,
    whole_where: IntArray,
    i: int,
) -> int:
    """Finds increments of level i that satisfy all rows if the rows are feasible; returns the fallback that
    was used."""
    if i > 0 and not t.level[i, ALONE]:
        # If U_{i−1} is almost the only feasible point, opposite bounds nearly coincide. The bounds are then
        # widened a little.
        if solve_level(data, where, whole, whole_where, i, TOLERANCE):
            return SOLVE
        copy_rows(t.U[i], p.wanted)
        copy_rows(t.U[i - 1], t.U[i])
        kept_rows(t, p, True)
        contain(t, t.U[i])
        fallback = on_the_way(t, p, i, INHERIT)
        kept_rows(t, p, False)
        return fallback
    kept_rows(t, p, True)
    widened = soften(t, p, d)
    if widened and solve_level(data, where, whole, whole_where, i, 0.0):
        if i > 0:
            kept_rows(t, p, False)
        return SOFTEN
    copy_rows(t.U[i], p.trial)  # `missed` uses `wanted`
    fallback = BRAKE
    if t.known[1] and t.fallback[i] <= SOFTENED:
        shifted(t.U_was[i], t.U[i])
        fallback = PREVIOUS if settled(t.U[i]) and missed(t, p, t.U[i]) == 0.0 else BRAKE
    if fallback == BRAKE:
        braking(t, p, d, t.U[i])
    copy_rows(p.trial, p.wanted)
    fallback = on_the_way(t, p, i, fallback)
    kept_rows(t, p, False)
    if i == 0:
        contain(t, t.U[0])
    return fallback


@inline_kernel
def kept_rows(t: TickArrays, p: LoopArrays, keep: bool) -> None:
    """Stores the bounds of this tick, or restores the stored bounds."""
    if keep:
        copy_rows(t.lower, p.lowest)
        copy_rows(t.upper, p.highest)
    else:
        copy_rows(p.lowest, t.lower)
        copy_rows(p.highest, t.upper)


@inline_kernel
def contain(t: TickArrays, U: Array) -> None:
    """Widens the rows until U meets them. Lower levels then start from the feasible point U."""
    constraint_values(U, constraints_of(t, t.reached))
    for row in range(len(t.L)):
        for a in range(U.shape[1]):
            t.lower[row, a] = min(t.lower[row, a], t.reached[row, a])
            t.upper[row, a] = max(t.upper[row, a], t.reached[row, a])


@inline_kernel
def shifted(U: Array, out: Array) -> None:
    """Computes the previous plan, shifted by one knot; the torque stays constant at its end."""
    N = len(U)
    for j in range(N):
        for a in range(U.shape[1]):
            out[j, a] = U[j + 1, a] if j + 1 < N else 0.0


@inline_kernel
def settled(U: Array) -> bool:
    """Returns whether all increments are finite."""
    total = 0.0
    for j in range(len(U)):
        total += dot(U[j], U[j], U.shape[1])
    return math.isfinite(total)


@inline_kernel
def on_the_way(t: TickArrays, p: LoopArrays, i: int, fallback: int) -> int:
    """Moves U_i, which meets the rows, towards `wanted` as far as the rows allow, if this improves the cost
    and changes nothing at the levels above. Returns FEASIBLE after a move, otherwise the argument
    `fallback`."""
    U, N = t.U[i], len(p.trial)
    t.kkt[i], t.active_count[i] = 0.0, 0
    if not settled(p.wanted):
        return fallback
    n = U.shape[1]
    for j in range(N):
        for a in range(n):
            p.wanted[j, a] -= U[j, a]
    constraint_values(U, constraints_of(t, t.reached))
    constraint_values(p.wanted, constraints_of(t, p.size))
    share = 1.0
    for row in range(len(t.L)):
        for a in range(n):
            change = p.size[row, a]
            if change != 0.0:
                room = (
                    t.upper[row, a] - t.reached[row, a]
                    if change > 0.0
                    else t.reached[row, a] - t.lower[row, a]
                )
                share = min(share, room / abs(change))
    if not share > 0.0:
        return fallback
    for j in range(N):
        for a in range(n):
            p.trial[j, a] = U[j, a] + share * p.wanted[j, a]
            p.wanted[j, a] *= share
    if i > 0 and not t.level[i, ALONE]:
        for above in range(i):
            for j in range(N):
                for row in range(t.level[above, FIRST], t.level[above, LAST]):
                    if abs(dot(t.B[j, row], p.wanted[j], n)) > LEAK:
                        return fallback
    if not cost(t, p, i, p.trial) < cost(t, p, i, U):
        return fallback
    copy_rows(p.trial, U)
    return FEASIBLE


@inline_kernel
def cost(t: TickArrays, p: LoopArrays, i: int, U: Array) -> float:
    """Returns the cost (32a) or (34a) of level i."""
    first, last = t.level[i, FIRST], t.level[i, LAST]
    effects(t.B, U, first, last, t.B_U)
    for j in range(len(U)):
        for row in range(first, last):
            t.e_1[j, row] = t.root_Q[row] * t.free[j, row]
    add_effects(t.C, t.B_U, first, last, t.row_knots, t.e_1)
    for a in range(U.shape[1]):
        p.weights[a] = t.rho[i] / (t.metric[i, a] * t.metric[i, a])
    return cost_of(t.e_1, U, p.weights, first, last, t.row_knots, t.level[i, KNOTS])

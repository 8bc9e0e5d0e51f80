"""Computes the evidence, the torque and the prediction of a tick."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import always_inline_kernel, inline_kernel
from himpc.tick.kernel.arrays import DIRECTED, PERIOD, T_S, IntArray, TickArrays, arrays_of
from himpc.tick.kernel.cascade import (
    ALONE,
    OWN_FIRST,
    OWN_KNOTS,
    OWN_LAST,
    SOFTENED,
    finite,
    predict,
)
from himpc.tick.kernel.evidence import bounds_met, cost_of, leak_of, quaternions
from himpc.tick.kernel.linear import copy, copy_rows
from himpc.tick.kernel.residual import add_effects, effects


@always_inline_kernel
def remember(t: TickArrays, r: int) -> None:
    """Stores the measured state and the results of r solved levels for the next tick."""
    copy(t.q, t.q_was, t.q.size)
    copy(t.v, t.v_was, t.v.size)
    copy(t.x_dot, t.x_dot_was, t.x_dot.size)
    copy_rows(t.predicted, t.path)
    for i in range(max(r, 1)):
        copy_rows(t.U[i], t.U_was[i])
    t.scalars[PERIOD] = t.scalars[T_S]
    t.known[1] = 1
    for i in range(r):
        if t.fallback[i] > SOFTENED:
            continue  # the active rows of a failed attempt are stored already
        t.warm_count[i] = t.active_count[i]
        for p in range(t.active_count[i]):
            t.warm_row[i, p], t.warm_joint[i, p] = t.active_row[i, p], t.active_joint[i, p]
            t.warm_multiplier[i, p] = t.multiplier[i, p]


@inline_kernel
def finish_tick(data: Any, where: IntArray, whole: IntArray, whole_where: IntArray, keep: int) -> bool:
    """Computes the evidence of all levels, the torque τ₀ + Δτ within its bounds, and the prediction (18).
    Returns False if the torque is not finite. keep: whether the results are stored for the next tick."""
    t = arrays_of(data, where, whole, whole_where)
    r, m = t.sizes[4], t.sizes[3]
    N, n = t.fixed.shape
    last = max(r, 1) - 1
    levels, increments = t.level, t.U[last]
    for i in range(r):
        effects(t.B, t.U[i], 0, m, t.effect[i])
    for i in range(r):
        applied = last if levels[last, ALONE] else i
        first, end = levels[i, OWN_FIRST], levels[i, OWN_LAST]
        for j in range(N):
            for row in range(first, end):
                t.e_1[j, row] = t.root_Q[row] * t.free[j, row]
        add_effects(t.C, t.effect[applied], first, end, t.row_knots, t.e_1)
        t.cost[i] = cost_of(t.e_1, t.U[applied], t.R[i], first, end, t.row_knots, levels[i, OWN_KNOTS])
        t.leak[i] = leak_of(i, levels, t.effect)
    for a in range(n):
        t.tau[a] = min(max(t.tau_0[a] + increments[0, a], t.limits[0, a]), t.limits[1, a])
    predict(t.q, t.v, t.v_was, increments, t.M_bar, t.scalars[PERIOD], t.scalars[T_S], t.predicted)
    if not finite(t.tau):
        return False
    for a in range(n):
        t.delta_tau[a], t.at_bound[a] = t.tau[a] - t.tau_0[a], 0.0
    most = 0.0
    for i in range(r):
        count = t.active_count[i]
        t.active[i] = count
        most = max(most, t.leak[i])
        bounds_met(
            *(count, t.active_row[i], t.active_joint[i], t.multiplier[i], t.stopping),
            *(t.bit, t.direction, len(t.bit) - t.sizes[DIRECTED] * N, t.at_bound),
        )
    t.priority_leak[0] = most if r > 1 else math.nan
    quaternions(t.task, t.R_now, t.quaternion)
    quaternions(t.task, t.R_d, t.quaternion_d)
    if keep:
        remember(t, r)
    return True

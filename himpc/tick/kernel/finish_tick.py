"""Entry: evidence, torque and prediction."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import INDICES, VECTOR, WHOLE, kernel
from himpc.compilation.views import matrices, matrix, vector
from himpc.tick.kernel.arena import AT, PERIOD, T_S, WHOLE_AT, Whole
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


@kernel(VECTOR, INDICES, INDICES, INDICES, WHOLE)
def finish_tick(data: Any, where: Whole, whole: Whole, whole_where: Whole, keep: int) -> bool:
    """Evidence of all levels, the torque τ₀ + Δτ within its bounds, and the prediction (18). False if the
    torque is not finite; else the tick is remembered, if it is to be kept."""
    s = vector(whole, whole_where[WHOLE_AT.sizes], 10)
    n, N, M, m, r, T, k = s[0], s[1], s[2], s[3], s[4], s[5], s[8] + 1
    last = max(r, 1) - 1
    levels = matrix(whole, whole_where[WHOLE_AT.level], r, 8)
    U, effect = matrices(data, where[AT.U], last + 1, N, n), matrices(data, where[AT.effect], r, N, M)
    B, free = matrices(data, where[AT.B], N, M, n), matrix(data, where[AT.free], N, M)
    root_Q, C = vector(data, where[AT.root_Q], M), matrix(data, where[AT.C], M, N)
    e, row_knots = matrix(data, where[AT.e_1], N, M), vector(whole, whole_where[WHOLE_AT.row_knots], M)
    R = matrix(data, where[AT.R], r, n)
    q, v = vector(data, where[AT.q], n), vector(data, where[AT.v], n)
    q_was, v_was = vector(data, where[AT.q_was], n), vector(data, where[AT.v_was], n)
    for i in range(r):
        effects(B, U[i], 0, m, effect[i])
    for i in range(r):
        applied = last if levels[last, ALONE] else i
        first, end = levels[i, OWN_FIRST], levels[i, OWN_LAST]
        for j in range(N):
            for row in range(first, end):
                e[j, row] = root_Q[row] * free[j, row]
        add_effects(C, effect[applied], first, end, row_knots, e)
        data[where[AT.cost] + i] = cost_of(e, U[applied], R[i], first, end, row_knots, levels[i, OWN_KNOTS])
        data[where[AT.leak] + i] = leak_of(i, levels, effect)
    active_row, active_joint = (
        matrix(whole, whole_where[WHOLE_AT.active_row], r, k),
        matrix(whole, whole_where[WHOLE_AT.active_joint], r, k),
    )
    multiplier, stopping = matrix(data, where[AT.multiplier], r, k), matrix(data, where[AT.stopping], 2, n)
    tau_0, tau = vector(data, where[AT.tau_0], n), vector(data, where[AT.tau], n)
    bound, predicted = matrix(data, where[AT.limits], 8, n), matrix(data, where[AT.predicted], N + 1, n)
    for a in range(n):
        tau[a] = min(max(tau_0[a] + U[last, 0, a], bound[0, a]), bound[1, a])
    predict(
        q,
        v,
        v_was,
        U[last],
        vector(data, where[AT.M_bar], n),
        data[where[AT.scalars] + PERIOD],
        data[where[AT.scalars] + T_S],
        predicted,
    )
    if not finite(tau):
        return False
    delta_tau, at_bound = vector(data, where[AT.delta_tau], n), vector(data, where[AT.at_bound], n)
    for a in range(n):
        delta_tau[a], at_bound[a] = tau[a] - tau_0[a], 0.0
    most = 0.0
    for i in range(r):
        count = whole[whole_where[WHOLE_AT.active_count] + i]
        data[where[AT.active] + i] = count
        most = max(most, data[where[AT.leak] + i])
        bounds_met(N, count, active_row[i], active_joint[i], multiplier[i], stopping, at_bound)
    data[where[AT.priority_leak]] = most if r > 1 else math.nan
    task = matrix(whole, whole_where[WHOLE_AT.task], T, 4)
    quaternions(task, matrices(data, where[AT.R_now], T, 3, 3), matrix(data, where[AT.quaternion], T, 4))
    quaternions(task, matrices(data, where[AT.R_d], T, 3, 3), matrix(data, where[AT.quaternion_d], T, 4))
    if keep:
        copy(q, q_was, n)
        copy(v, v_was, n)
        copy(vector(data, where[AT.x_dot], M), vector(data, where[AT.x_dot_was], M), M)
        copy_rows(predicted, matrix(data, where[AT.path], N + 1, n))
        U_was = matrices(data, where[AT.U_was], last + 1, N, n)
        for i in range(last + 1):
            copy_rows(U[i], U_was[i])
        data[where[AT.scalars] + PERIOD] = data[where[AT.scalars] + T_S]
        whole[whole_where[WHOLE_AT.known] + 1] = 1
        warm_row, warm_joint = (
            matrix(whole, whole_where[WHOLE_AT.warm_row], r, k),
            matrix(whole, whole_where[WHOLE_AT.warm_joint], r, k),
        )
        warm_multiplier = matrix(data, where[AT.warm_multiplier], r, k)
        for i in range(r):
            if data[where[AT.rung] + i] > SOFTENED:
                continue  # what the attempt left is there already
            active = whole[whole_where[WHOLE_AT.active_count] + i]
            whole[whole_where[WHOLE_AT.warm_count] + i] = active
            for p in range(active):
                warm_row[i, p], warm_joint[i, p] = active_row[i, p], active_joint[i, p]
                warm_multiplier[i, p] = multiplier[i, p]
    return True

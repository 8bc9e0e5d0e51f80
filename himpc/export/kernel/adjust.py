"""Writes settings that change while the robot moves to the arrays of a tick."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.controllers.himpc import ENABLE_SECONDS, FAINTEST
from himpc.export.kernel.follow import MISFIT, NO_HIERARCHY, NOT_USABLE, drag
from himpc.export.kernel.guard import observe_anew
from himpc.export.kernel.loop_arrays import BUDGET as ALLOWED
from himpc.export.kernel.loop_arrays import DAMPS, FADING, LEVELS, ON_ACCELERATION, SIMPLE, LoopArrays
from himpc.limits.limits import POSITION_MARGIN
from himpc.limits.ramp import RAMP_SECONDS
from himpc.qp import KKT_TOLERANCE
from himpc.tick.kernel.arrays import T_S, Array, TickArrays
from himpc.tick.kernel.bounds import PAPER
from himpc.tick.kernel.cascade import AFRESH, FIRST, LAST
from himpc.tick.kernel.linear import copy, copy_rows, dot
from himpc.tick.kernel.pair_arrays import PairArrays
from himpc.tick.tables import ACCURACY

TARGET, M_BAR, GAINS, WEIGHT_Q, WEIGHT_R, LIMITS, ENABLED, ORDER, WEIGHTS, BUDGET, OBJECT = range(11)
"""The kinds of settings."""
_MODE = 9
"""Index in `sizes` of the kind of position limits."""


@inline_kernel
def adjust(
    t: TickArrays, p: LoopArrays, d: PairArrays, what: int, index: int, values: Array, count: int
) -> int:
    """Changes a setting and returns 0. If the request is not valid, it changes nothing and returns FIXED,
    MISFIT, NOT_USABLE or NO_HIERARCHY.

    Args:
        what: TARGET … OBJECT.
        index: index of the task (TARGET, GAINS), of the level (WEIGHT_Q, WEIGHT_R, WEIGHTS, ENABLED) or of
            the object (OBJECT).
        values, count: the numbers of the setting. TARGET: see `drag`. M_BAR: (n) kg·m². GAINS: K_p (m) 1/s²,
            then K_v (m) 1/s. WEIGHT_Q: (m). WEIGHT_R: (n). LIMITS: torque (n) N·m, velocity (n) rad/s, lower
            and upper position (n) rad each, see `LoopArrays.widest`. ENABLED: 0 or 1. ORDER: the indices of
            all levels (r), highest priority first; a damping level stays the last. WEIGHTS: Q (m), R (n).
            BUDGET: the largest number of multiplications for changes of active rows in a period. OBJECT: see
            `move_object`.
    """
    if what == OBJECT:
        return move_object(d, index, values, count)
    fault = change(t, p, what, index, values, count)
    if fault == 0 and what != TARGET and what != BUDGET:
        observe_anew(p)
    return fault


@inline_kernel
def change(t: TickArrays, p: LoopArrays, what: int, index: int, values: Array, count: int) -> int:
    """Changes a setting other than OBJECT, see `adjust`."""
    n, r = t.q.size, int(p.setup[LEVELS])
    if not dot(values, values, count) < 1e18 and what != LIMITS:
        return NOT_USABLE
    of_task = what in (TARGET, GAINS)
    if what < 0 or what > BUDGET or index < 0 or index >= (len(t.task) if of_task else r):
        return MISFIT
    if what == TARGET:
        return drag(t, p, index, values, count)
    if what == LIMITS:
        return set_limits(p, values, n) if count == 4 * n else MISFIT
    first, last = int(p.table[index, FIRST]), int(p.table[index, LAST])
    if what == GAINS:
        first, last = t.task[index, 2], t.task[index, 2] + t.task[index, 3]
    size = last - first
    wanted = n if what in (M_BAR, WEIGHT_R) else 2 * size if what == GAINS else size
    if what in (ENABLED, BUDGET):
        wanted = 1
    elif what == ORDER:
        wanted = r
    elif what == WEIGHTS:
        wanted = size + n
    if count != wanted:
        return MISFIT
    if what != ENABLED and what != ORDER:
        for k in range(count):
            if not (values[k] > 0.0 or (what == GAINS and values[k] == 0.0)):
                return NOT_USABLE
    tied = what in (WEIGHT_R, ENABLED, ORDER, WEIGHTS) or (what == M_BAR and p.setup[ON_ACCELERATION] != 0.0)
    if tied and p.setup[SIMPLE] == 0.0:
        return NO_HIERARCHY
    if what == GAINS:
        copy(values, t.K_p[first:last], size)
        copy(values[size:], t.K_v[first:last], size)
        write_rows(t, p, first, last)
    elif what in (WEIGHT_Q, WEIGHTS):
        copy(values, p.Q[first:last], size)
        write_rows(t, p, first, last)
        if what == WEIGHTS:
            copy(values[size:], p.R[index], n)
            arrange(t, p)
    elif what == BUDGET:
        p.setup[ALLOWED] = values[0]
    elif what == ENABLED:
        switch(t, p, index, values[0] != 0.0)
    elif what == ORDER:
        return reorder(t, p, values)
    else:
        copy(values, t.M_bar if what == M_BAR else p.R[index], n)
        arrange(t, p)
    return 0


@inline_kernel
def move_object(d: PairArrays, index: int, values: Array, count: int) -> int:
    """Moves an object that the controller knows; returns 0, MISFIT or NOT_USABLE.

    values: x, y and z in m (the centre, of a post its foot, of a floor a point of its surface), the turn
        about the vertical in rad, and the velocity in m/s, (7,).
    """
    if index < 0 or index >= d.kind.size - d.joint.size or count != 7:
        return MISFIT
    if not dot(values, values, count) < 1e18:
        return NOT_USABLE
    cos, sin = math.cos(values[3]), math.sin(values[3])
    turn = d.turn[index]
    turn[0, 0], turn[0, 1], turn[1, 0], turn[1, 1] = cos, -sin, sin, cos
    copy(values, d.middle[index], 3)
    copy(values[4:], d.velocity[index], 3)
    return 0


@inline_kernel
def set_limits(p: LoopArrays, values: Array, n: int) -> int:
    """Sets the desired limits. The limits in force approach them, see `close_in`. Limits beyond
    `LoopArrays.widest` are not usable, and neither are limits that are not finite where that is finite."""
    for a in range(n):
        torque, speed, low, high = values[a], values[n + a], values[2 * n + a], values[3 * n + a]
        if not (0.0 < torque <= p.widest[0, a] and 0.0 < speed <= p.widest[1, a]):
            return NOT_USABLE
        if not (p.widest[2, a] <= low < high <= p.widest[3, a]):
            return NOT_USABLE
    for a in range(n):
        p.goal[0, a], p.goal[1, a], p.goal[2, a] = -values[a], values[a], values[n + a]
        p.goal[6, a], p.goal[7, a] = values[2 * n + a], values[3 * n + a]
    return 0


@inline_kernel
def write_rows(t: TickArrays, p: LoopArrays, first: int, last: int) -> None:
    """Writes √Q, the effect coefficients and the coefficients of the free motion of some rows. They depend on
    the gains, on Q, and on the share of Q that is in force; see `himpc.prediction.residual_model`."""
    N, T_s = len(t.fixed), t.scalars[T_S]
    for i in range(first, last):
        K, K_p, K_v = t.row_knots[i], t.K_p[i], t.K_v[i]
        weight = p.weight[i]
        share = 1.0 if weight >= 1.0 else math.sqrt(math.exp(math.log(FAINTEST) * (1.0 - weight)))
        root = share * math.sqrt(p.Q[i])
        t.root_Q[i] = root
        for k in range(N):
            t.on_velocity[k, i] = K_v + K_p * T_s * (k + 1.0)
            t.on_acceleration[k, i] = 1.0 + K_v * T_s * (k + 1.0) + K_p * T_s * T_s * k * (k + 1.0) / 2.0
        for k in range(K):
            t.C[i, k] = root * (1.0 + K_v * T_s * (k + 1.0) + K_p * T_s * T_s * k * (k + 1.0) / 2.0)
        S, C = t.S[i], t.C[i]
        for a in range(K - 1, -1, -1):
            for b in range(K - 1, -1, -1):
                inner = S[a + 1, b + 1] if max(a, b) + 1 < K else 0.0
                S[a, b] = inner + C[K - 1 - a] * C[K - 1 - b]


@inline_kernel
def fade(t: TickArrays, p: LoopArrays) -> None:
    """Increases the weights of the rows that fade in, by the amount for one period."""
    if p.state[FADING] == 0.0:
        return
    p.state[FADING] = 0.0
    for i in range(len(p.weight)):
        weight = p.weight[i]
        if weight < 1.0:
            write_rows(t, p, i, i + 1)
            p.weight[i] = weight + t.scalars[T_S] / ENABLE_SECONDS
            p.state[FADING] = 1.0
        elif weight > 1.0 or t.root_Q[i] * t.root_Q[i] < p.Q[i] * (1.0 - 1e-12):
            p.weight[i] = 1.0
            write_rows(t, p, i, i + 1)


@inline_kernel
def switch(t: TickArrays, p: LoopArrays, index: int, on: bool) -> None:
    """Switches a level on or off; its rows fade in."""
    if on == (p.enabled[index] != 0.0):
        return
    p.enabled[index] = 1.0 if on else 0.0
    if on:
        for i in range(int(p.table[index, FIRST]), int(p.table[index, LAST])):
            p.weight[i] = 0.0
        p.state[FADING] = 1.0
    arrange(t, p)
    t.known[1] = 0
    for i in range(len(p.enabled)):
        t.warm_count[i] = 0


@inline_kernel
def reorder(t: TickArrays, p: LoopArrays, values: Array) -> int:
    """Changes the order of the levels; returns 0, or NOT_USABLE for an invalid order. The last solution of
    each level moves with the level, see `himpc.tick.tick.CompiledTick.recall`."""
    r, moved = len(p.order), False
    for k in range(r):
        count = 0
        for i in range(r):
            count += values[i] == k
        if count != 1 or (p.setup[DAMPS] != 0.0 and k == r - 1 and values[k] != k):
            return NOT_USABLE
        moved = moved or values[k] != p.order[k]
    if not moved:
        return 0
    for i in range(r):
        if p.solved_index[i] >= 0.0:
            copy_rows(t.U[int(p.solved_index[i])], p.before[i])
    copy(values, p.order, r)
    arrange(t, p)
    for i in range(r):
        if p.solved_index[i] >= 0.0 and t.known[1]:
            copy_rows(p.before[i], t.U_was[int(p.solved_index[i])])
        t.warm_count[i] = 0
    t.known[0] = 0
    return 0


@inline_kernel
def arrange(t: TickArrays, p: LoopArrays) -> None:
    """Writes the tables of the levels that are on, see `himpc.tick.tables.write_levels`. Without a strict
    hierarchy they stay as they are."""
    if p.setup[SIMPLE] == 0.0:
        return
    n, r, choice, count = t.q.size, int(p.setup[LEVELS]), 0, 0
    damping = r - 1 if p.setup[DAMPS] != 0.0 else -1
    for i in range(r):
        if i != damping and p.enabled[i] != 0.0:
            choice += 1 << i
    for at in range(r):
        i = int(p.order[at])
        p.solved_index[i] = -1.0
        if (p.damped[choice] if i == damping else p.enabled[i]) == 0.0:
            continue
        p.solved_index[i] = count
        for column in range(8):
            t.level[count, column] = int(p.table[i, column])
        least = math.inf
        for a in range(n):
            scale = 1.0 / (t.M_bar[a] * t.M_bar[a]) if p.setup[ON_ACCELERATION] != 0.0 else 1.0
            t.R[count, a] = p.R[i, a] * scale
            least = min(least, t.R[count, a])
        t.rho[count], t.accuracy[count] = least, min(ACCURACY * least, KKT_TOLERANCE)
        t.level[count, AFRESH] = 0
        for a in range(n):
            t.metric[count, a] = math.sqrt(least / t.R[count, a])
            if count > 0 and t.metric[count - 1, a] != t.metric[count, a]:
                t.level[count, AFRESH] = 1
        count += 1
    t.sizes[4] = count
    if count == 0:
        for j in range(len(t.fixed)):
            for a in range(n):
                t.U[0, j, a] = 0.0


@inline_kernel
def close_in(now: float, goal: float, present: float, size: float, T_s: float) -> float:
    """Returns an upper limit one period later, see `himpc.limits.ramp`."""
    start = min(now, max(present, goal))
    if not (math.isfinite(start) and math.isfinite(goal)):
        return goal
    rate = max(start - goal, 0.1 * size) / RAMP_SECONDS
    return max(goal, start - rate * T_s)


@inline_kernel
def ramp(t: TickArrays, p: LoopArrays) -> None:
    """Moves the limits in force towards the desired limits."""
    now, goal, T_s = t.limits, p.goal, t.scalars[T_S]
    margin = 0.0 if t.sizes[_MODE] == PAPER else POSITION_MARGIN
    for a in range(t.q.size):
        torque = abs(t.tau_0[a])
        now[1, a] = close_in(now[1, a], goal[1, a], torque, goal[1, a], T_s)
        now[0, a] = -close_in(-now[0, a], -goal[0, a], torque, -goal[0, a], T_s)
        now[2, a] = close_in(now[2, a], goal[2, a], abs(t.v[a]), goal[2, a], T_s)
        now[7, a] = close_in(now[7, a], goal[7, a], t.q[a], 1.0, T_s)
        now[6, a] = -close_in(-now[6, a], -goal[6, a], -t.q[a], 1.0, T_s)
        now[3, a], now[4, a], now[5, a] = now[6, a] + margin, now[7, a] - margin, goal[5, a]

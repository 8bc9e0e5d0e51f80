"""The entry point of an exported controller: a whole control period, a reset, or a setting; see
`himpc.export.entries`."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.export.kernel.adjust import adjust, arrange, fade, ramp, write_rows
from himpc.export.kernel.fallbacks import HOLD, SOLVE, period_with_fallbacks
from himpc.export.kernel.follow import follow, rest_at_targets
from himpc.export.kernel.guard import guard, remember_errors, unguarded
from himpc.export.kernel.loop_arrays import (
    BUDGET,
    FADING,
    MOST,
    STARTED,
    TICKS,
    TOLERANCE,
    LoopArrays,
    loop_arrays_of,
)
from himpc.tick.kernel.arrays import DIRECTED, NOW, PERIOD, T_S, Array, IntArray, TickArrays, arrays_of
from himpc.tick.kernel.cascade import finite
from himpc.tick.kernel.control_period import ALL_PARTS, ITERATION
from himpc.tick.kernel.distance_rows import FASTEST as OBJECT_SPEED
from himpc.tick.kernel.distance_rows import ROOM, write_distance_rows
from himpc.tick.kernel.finish_tick import finish_tick
from himpc.tick.kernel.linear import copy, copy_rows
from himpc.tick.kernel.pair_arrays import PairArrays, pair_arrays_of

TICK, RESET = -2, -1
"""Requests to `control`; all other values are settings, see `adjust`."""


@inline_kernel
def control(
    data: Array,
    where: IntArray,
    whole: IntArray,
    whole_where: IntArray,
    loop: Array,
    loop_where: IntArray,
    pairs: Array,
    pairs_where: IntArray,
    pairs_whole: IntArray,
    pairs_whole_where: IntArray,
    what: int,
    index: int,
    x: Array,
    v: Array,
    tau_applied: Array,
    tau: Array,
) -> int:
    """Performs a request to a controller.

    Args:
        data, where, whole, whole_where: the arena of a tick.
        loop, loop_where: see `loop_arrays_of`.
        pairs, pairs_where, pairs_whole, pairs_whole_where: see `pair_arrays_of`.
        what: TICK, RESET or a setting.
        index: for TICK and RESET, whether a torque is an argument; otherwise see `adjust`.
        x: for TICK q, (n,) rad; for RESET the torque that acts now, (n,) N·m; otherwise the values of the
            setting.
        v, tau_applied, tau: only for TICK.

    Returns:
        for TICK, SOLVE or the last of the fallbacks that acted; otherwise 0 or a fault, see `adjust`.
    """
    t = arrays_of(data, where, whole, whole_where)
    p = loop_arrays_of(loop, loop_where, t)
    d = pair_arrays_of(pairs, pairs_where, pairs_whole, pairs_whole_where)
    if what == TICK:
        return whole_tick(t, p, d, data, where, whole, whole_where, x, v, tau_applied, index, tau)
    if what == RESET:
        return restart(t, p, d, x, index)
    return adjust(t, p, d, what, index, x, x.size)


@inline_kernel
def whole_tick(
    t: TickArrays,
    p: LoopArrays,
    d: PairArrays,
    data: Array,
    where: IntArray,
    whole: IntArray,
    whole_where: IntArray,
    q: Array,
    v: Array,
    tau_applied: Array,
    measured: int,
    tau: Array,
) -> int:
    """Performs one control period: computes the torque from the measured state, as
    `himpc.controllers.himpc.HIMPC.step` does.

    Args:
        t, p, d: the arrays.
        data, where, whole, whole_where: the arena of a tick.
        q, v: measured state, (n,) rad and rad/s.
        tau_applied: the torque that acted during the last period, (n,) N·m.
        measured: whether `tau_applied` is valid; otherwise the torque that the last call computed is used.
        tau: the torque to apply from now on, (n,) N·m; finite and within the limits in force for every state.

    Returns:
        SOLVE, or the last of the fallbacks that acted.
    """
    if measured and finite(tau_applied):
        take_torque(t, p, tau_applied)
    hold(t, p)  # if the period fails, this torque can be applied
    copy(t.tau, tau, tau.size)
    p.state[TICKS] += 1.0
    if not (finite(q) and finite(v)):
        return forget(t, p)
    copy(q, t.q, q.size)
    copy(v, t.v, v.size)
    copy(p.v_ramped, t.limits[2], v.size)
    ramp(t, p)
    guard(t, p, d)
    fade(t, p)
    if p.state[STARTED] == 0.0:
        begin(t)
    t.scalars[NOW] = (p.state[TICKS] - 1.0) * t.scalars[T_S]
    follow(t, p, p.state[TICKS] > 1.0)
    fallback = iterate(t, p, d, data, where, whole, whole_where)
    if fallback == HOLD:
        hold(t, p)
        copy(t.tau, tau, tau.size)
        return forget(t, p)
    remember_errors(t, p)
    p.state[STARTED] = 1.0
    copy(t.tau, tau, tau.size)
    copy(t.tau, t.tau_0, tau.size)
    return fallback


@inline_kernel
def iterate(
    t: TickArrays,
    p: LoopArrays,
    d: PairArrays,
    data: Array,
    where: IntArray,
    whole: IntArray,
    whole_where: IntArray,
) -> int:
    """Solves all levels once; for NHIMPC, it repeats this until no increment changes. Returns the last of the
    fallbacks that acted, HOLD if no torque was computed."""
    t.budget[0] = p.setup[BUDGET]
    most, change, count, fallback = int(p.setup[MOST]), math.inf, 0, SOLVE
    while count == 0 or (change > p.setup[TOLERANCE] and count < most):
        if count:
            # J_i(q_{k+j|k}): the knots of this tick's own prediction replace the knots of the last tick's
            # prediction.
            for j in range(1, len(t.path)):
                copy(t.predicted[j - 1], t.path[j], t.q.size)
            for i in range(t.sizes[4]):
                copy_rows(t.U[i], p.before[i])
        if t.sizes[DIRECTED] > 0:
            write_distance_rows(t, d, 0)
        parts = ALL_PARTS if most == 1 else ITERATION
        fallback = period_with_fallbacks(t, p, d, data, where, whole, whole_where, parts)
        if fallback == HOLD:
            return HOLD
        if count:
            change = 0.0
            for i in range(t.sizes[4]):
                for j in range(len(t.fixed)):
                    for a in range(t.q.size):
                        change = max(change, abs(t.U[i, j, a] - p.before[i, j, a]))
        count += 1
        if fallback != SOLVE:
            break  # another iteration needs optima at all levels
    if most > 1:
        finish_tick(data, where, whole, whole_where, True)
    return fallback


@inline_kernel
def take_torque(t: TickArrays, p: LoopArrays, tau: Array) -> None:
    """Stores the torque that acts now, within the joints' torque limits. A larger reading is wrong, and
    bounds must not start from it."""
    for a in range(t.q.size):
        reach = max(p.tau_limit[a], p.goal[1, a])
        t.tau_0[a] = min(max(tau[a], -reach), reach)


@inline_kernel
def hold(t: TickArrays, p: LoopArrays) -> None:
    """Computes the torque to hold: the torque that acts now, within the limits in force."""
    for a in range(t.q.size):
        reach = max(p.tau_limit[a], p.goal[1, a])
        t.tau[a] = min(max(t.tau_0[a], max(t.limits[0, a], -reach)), min(t.limits[1, a], reach))


@inline_kernel
def forget(t: TickArrays, p: LoopArrays) -> int:
    """Ends a period without a usable state: the held torque acts from now on, and the memory is cleared."""
    copy(t.tau, t.tau_0, t.q.size)
    p.state[STARTED] = 0.0
    return HOLD


@inline_kernel
def begin(t: TickArrays) -> None:
    """Sets the memory to that of a robot that has moved with constant velocity so far, as
    `himpc.tick.tick.CompiledTick.recall` does."""
    T_s = t.scalars[T_S]
    copy(t.q, t.q_was, t.q.size)
    copy(t.v, t.v_was, t.q.size)
    t.scalars[PERIOD] = T_s
    t.known[0], t.known[1] = 0, 0
    for i in range(len(t.warm_count)):
        t.warm_count[i] = 0
        for j in range(len(t.fixed)):
            for a in range(t.q.size):
                t.U_was[i, j, a] = 0.0
    for j in range(1, len(t.path)):
        for a in range(t.q.size):
            t.path[j, a] = t.q[a] + T_s * (j - 1.0) * t.v[a]


@inline_kernel
def restart(t: TickArrays, p: LoopArrays, d: PairArrays, tau: Array, known: int) -> int:
    """Clears everything except the settings, and sets the filtered targets to their raw targets, at rest.

    tau: the torque that acts now, (n,) N·m; if `known` is 0, the torque is zero.
    """
    for a in range(t.q.size):
        t.tau_0[a] = 0.0
    if known and finite(tau):
        take_torque(t, p, tau)
    for a in range(t.q.size):
        t.limits[0, a], t.limits[1, a], t.limits[2, a] = -math.inf, math.inf, math.inf
        t.limits[6, a], t.limits[7, a] = -math.inf, math.inf
    p.v_ramped[:], p.weight[:] = math.inf, 1.0
    d.about[ROOM], d.about[OBJECT_SPEED] = math.inf, 0.0
    unguarded(p)
    p.state[STARTED], p.state[TICKS], p.state[FADING] = 0.0, 0.0, 0.0
    arrange(t, p)
    write_rows(t, p, 0, t.sizes[3])
    rest_at_targets(t, p)
    return 0

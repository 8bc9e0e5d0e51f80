"""Entry point: computes the velocity limits of a controller that keeps distances, see `limits.load`,
`limits.overrun` and `limits.stall`."""

from __future__ import annotations

from typing import Any

from himpc.compilation.compiled import FLAG, FLAGS, GIVEN_VECTOR, NUMBER, VECTOR, inline_kernel, kernel
from himpc.constants import (
    BLOCKED,
    CLOSE_ENOUGH,
    DISTURBED,
    FREE_LOAD,
    FULL_LOAD,
    HEAVY_LOAD,
    INSIDE,
    LEAD,
    LEAST_SHARE,
    LEAST_WHILE_FASTER,
    LOAD_SECONDS,
    MEAN_SECONDS,
    PROGRESS,
    PROGRESS_SHARE,
    RECOVERY,
    REST,
    SLOWEST,
    SLOWEST_SHARE,
    SLOWING,
    STALLED,
)
from himpc.tick.kernel.arrays import Array

STALL_SHARE, STALL_LEAST = range(2)
"""Indices of the numbers about the stall, see `limits.stall.Stall`."""


@inline_kernel
def update_stall(errors: Array, moves: bool, room: float, T_s: float, due: Array, stall: Array) -> None:
    """Computes the stall one period later, see `limits.stall.stalled`."""
    far, free = False, moves or not INSIDE <= room <= BLOCKED
    for p in range(len(errors)):
        far = far or errors[p] > CLOSE_ENOUGH
    brakes, rests = REST < stall[STALL_SHARE] < STALLED, stall[STALL_SHARE] <= REST
    if free or not far or (errors[0] > stall[STALL_LEAST] + DISTURBED and not brakes):
        due[:], stall[STALL_LEAST], slows = errors, errors[0], False
    else:
        nearer = False
        for p in range(len(errors)):
            due[p] = min(errors[p], due[p] - (PROGRESS + PROGRESS_SHARE * errors[p]) * T_s)
            nearer = nearer or (errors[p] > CLOSE_ENOUGH and errors[p] <= due[p] + CLOSE_ENOUGH)
        stall[STALL_LEAST] = errors[0] if brakes else min(errors[0], stall[STALL_LEAST])
        slows = brakes or rests or not nearer
    goal, seconds = (0.0, SLOWING) if slows else (1.0, RECOVERY)
    stall[STALL_SHARE] += min(1.0, T_s / seconds) * (goal - stall[STALL_SHARE])


@kernel(
    *(VECTOR, VECTOR, GIVEN_VECTOR, GIVEN_VECTOR, FLAGS, NUMBER, FLAG, NUMBER),
    *(VECTOR, VECTOR, VECTOR, VECTOR, VECTOR, VECTOR),
)
def slow_down(
    v_limit: Array,
    largest_torque: Array,
    tau: Array,
    v: Array,
    carried: Any,
    room: float,
    moves: bool,
    T_s: float,
    errors: Array,
    due: Array,
    stall: Array,
    load: Array,
    mean: Array,
    slower: Array,
) -> None:
    """Updates the load, the mean velocities and the stall by one control period, and computes the velocity
    limits.

    Args:
        v_limit: (n,) rad/s, the limits without reductions. largest_torque: (n,) N·m.
        tau: torque that acts, (n,) N·m. v: measured, (n,) rad/s.
        carried: (n, n), entry [k, j]: whether the motor of joint j carries joint k.
        room, moves, T_s, errors: see `limits.stall.stalled`. The stall is not updated if `errors` is empty.
        due: (T,), see `Stall`; updated. stall: numbers about the stall, see STALL_SHARE; updated.
        load: (n,), see `limits.load.loaded`; updated.
        mean: (n,) rad/s, see `limits.overrun.followed`; updated.
        slower: (n,) rad/s; the result.
    """
    n = len(v_limit)
    heaviest, fast = -1.0, False
    for a in range(n):
        load[a] += min(1.0, T_s / LOAD_SECONDS) * (abs(tau[a]) / largest_torque[a] - load[a])
        heaviest = max(heaviest, load[a])
        mean[a] += min(1.0, T_s / MEAN_SECONDS) * (v[a] - mean[a])
    for a in range(n):
        slower[a] = v_limit[a]
        if heaviest > FREE_LOAD:
            share = 1.0
            for j in range(n):
                if carried[a, j]:
                    share = min(share, max((FULL_LOAD - load[j]) / (FULL_LOAD - FREE_LOAD), SLOWEST_SHARE))
            slower[a] *= share
        gained = (LEAD / MEAN_SECONDS) * (abs(v[a]) - abs(mean[a]))
        fast = fast or not abs(v[a]) + gained <= LEAST_WHILE_FASTER * slower[a]
    if fast:
        for a in range(n):
            gained = (LEAD / MEAN_SECONDS) * (abs(v[a]) - abs(mean[a]))
            slower[a] = max(slower[a] - max(gained, 0.0), LEAST_WHILE_FASTER * slower[a])
    if len(errors):
        update_stall(errors, moves, min(room, BLOCKED) if heaviest > HEAVY_LOAD else room, T_s, due, stall)
    if stall[STALL_SHARE] <= 1.0 - 1e-6:
        for a in range(n):
            slow = min(slower[a], SLOWEST)
            slower[a] = slow + max(stall[STALL_SHARE], LEAST_SHARE) * (slower[a] - slow)

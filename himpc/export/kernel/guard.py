"""The guard of a robot that is blocked or near an object: the functions of `himpc.controllers.stall_guard` on
arrays."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.constants import MOVING, MOVING_ANYWHERE
from himpc.export.kernel.loop_arrays import (
    ERRORS,
    FASTEST,
    GUARD,
    GUARDED,
    LARGEST_ERROR,
    LEVELS,
    MARGIN,
    STALL,
    UNGUARDED,
    LoopArrays,
)
from himpc.tick.kernel.arrays import PULL, T_S, TickArrays
from himpc.tick.kernel.cascade import FIRST, LAST
from himpc.tick.kernel.distance_rows import FASTEST as FASTEST_OBJECT
from himpc.tick.kernel.distance_rows import ROOM
from himpc.tick.kernel.linear import copy
from himpc.tick.kernel.pair_arrays import PairArrays
from himpc.tick.kernel.progress import error_length, fastest_reference
from himpc.tick.kernel.slow_down import lower_velocities
from himpc.tick.kernel.windup import resist_windup


@inline_kernel
def unguarded(p: LoopArrays) -> None:
    """Clears the guard's data."""
    p.state[GUARDED], p.state[ERRORS], p.state[FASTEST] = 0.0, 0.0, 0.0


@inline_kernel
def observe_anew(p: LoopArrays) -> None:
    """Lets the guard observe the progress of the tasks anew, since their settings have changed. It keeps what
    it knows of the joints."""
    p.due[:], p.stall[0], p.stall[1], p.state[ERRORS] = math.inf, 1.0, math.inf, 0.0


@inline_kernel
def guard(t: TickArrays, p: LoopArrays, d: PairArrays) -> None:
    """Lowers the velocity limits in force, and sets the largest error on which tasks act."""
    n, kind, T_s = t.q.size, p.setup[GUARD], t.scalars[T_S]
    copy(t.limits[2], p.v_ramped, n)
    if kind == UNGUARDED:
        return
    if p.state[GUARDED] == 0.0:
        observe_anew(p)
        p.load[:], p.wound[:], p.windup[0], p.windup[1] = 0.0, 0.0, 0.0, 1.0
        copy(t.v, p.mean, n)
        copy(t.tau_0, p.tau_before, n)
        p.state[GUARDED] = 1.0
    for a in range(n):
        p.free_limit[a] = (1.0 - p.setup[MARGIN]) * p.v_ramped[a]
        p.largest_torque[a] = max(t.limits[1, a], -t.limits[0, a])
    moves = p.state[FASTEST] > (MOVING if kind == STALL else MOVING_ANYWHERE)
    room = d.about[ROOM] if kind == STALL else 0.0
    close = moves or (kind == STALL and d.about[FASTEST_OBJECT] > MOVING)
    errors = int(p.state[ERRORS])
    lower_velocities(
        *(p.free_limit, p.largest_torque, t.tau_0, t.v, p.carried, room, close, T_s),
        *(p.errors[:errors], p.due, p.stall, p.load, p.mean, t.limits[2]),
    )
    t.scalars[PULL] = p.setup[LARGEST_ERROR]
    if kind != STALL:
        largest = resist_windup(
            *(t.M_bar, p.v_limit, t.tau_0, t.v, moves, T_s, p.tau_before, p.wound, p.windup, t.limits[2])
        )
        t.scalars[PULL] = min(t.scalars[PULL], largest)


@inline_kernel
def remember_errors(t: TickArrays, p: LoopArrays) -> None:
    """Stores the errors of the tasks that are solved, those of the highest level first, and the largest
    velocity of a reference."""
    count = 0
    for at in range(int(p.setup[LEVELS])):
        i = int(p.order[at])
        if p.solved_index[i] < 0.0:
            continue
        for task in range(len(t.task)):
            first, size = t.task[task, 2], t.task[task, 3]
            if p.table[i, FIRST] <= first < p.table[i, LAST]:
                p.errors[count] = error_length(t, first, first + size)
                count += 1
    p.state[ERRORS], p.state[FASTEST] = float(count), fastest_reference(t)

"""Dragged targets: the functions of `himpc.references.target` on arrays."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.export.kernel.loop_arrays import DRAGGABLE, KNOWN, ROWS, WIDTH, LoopArrays
from himpc.tick.kernel.arrays import T_S, Array, TickArrays
from himpc.tick.kernel.kinematics import POSITION
from himpc.tick.kernel.linear import copy, dot
from himpc.tick.kernel.target import following


@inline_kernel
def follow(t: TickArrays, p: LoopArrays, later: bool) -> None:
    """For all tasks with a draggable target, writes x_d and its motion over the horizon.

    later: whether a period has passed since the last call.
    """
    N, T_s = len(t.fixed), t.scalars[T_S]
    for task in range(len(t.task)):
        if p.target[task, DRAGGABLE] == 0.0:
            continue
        m, width, known = int(p.target[task, ROWS]), int(p.target[task, WIDTH]), int(p.target[task, KNOWN])
        samples, raw, caps = p.samples[task], p.raw[task][:width], p.caps[task]
        if later and known > 0:
            if known == 1:
                following(samples[0], samples[1], raw, caps, T_s, m, width)
                known = 2
            known -= 1
            for j in range(known):
                copy(samples[j + 1], samples[j], samples.shape[1])
            if samples[0, width + 3 * m] > 0.0:
                known = 0
        if known > 0:
            for j in range(known, N + 1):
                following(samples[j - 1], samples[j], raw, caps, T_s, m, width)
            known = N + 1
        p.target[task, KNOWN] = float(known)
        show(t, task, samples, m, width, known > 0)


@inline_kernel
def show(t: TickArrays, task: int, samples: Array, m: int, width: int, moving: bool) -> None:
    """Writes the samples of one target to the arrays that `linearize` reads."""
    first = t.task[task, 2]
    if width > m:
        for a in range(9):
            t.R_d[task, a // 3, a % 3] = samples[0, a]
    else:
        for a in range(m):
            t.x_d[first + a] = samples[0, a]
    for a in range(m):
        gone = 0.0
        for j in range(len(t.fixed) + 1):
            if moving and j:
                gone += samples[j, width + 2 * m + a]
            t.motion[0, j, first + a] = gone
            t.motion[1, j, first + a] = samples[j, width + a] if moving else 0.0
            t.motion[2, j, first + a] = samples[j, width + m + a] if moving else 0.0


@inline_kernel
def rest_at_targets(t: TickArrays, p: LoopArrays) -> None:
    """Sets all filtered targets to their raw targets, at rest."""
    for task in range(len(t.task)):
        width = int(p.target[task, WIDTH])
        copy(p.raw[task], p.samples[task, 0], width)
        p.target[task, KNOWN] = 0.0


@inline_kernel
def drag(t: TickArrays, p: LoopArrays, task: int, values: Array, count: int) -> int:
    """Moves a raw target: a position by its three coordinates (m), an orientation by its quaternion x y z w,
    joints by their coordinates (rad). Returns 0 or a fault, see `adjust`."""
    if p.target[task, DRAGGABLE] == 0.0:
        return FIXED
    m, width = int(p.target[task, ROWS]), int(p.target[task, WIDTH])
    raw, first = p.raw[task], t.task[task, 2]
    if width > m:
        if count != 4:
            return MISFIT
        if not to_rotation(values, raw):
            return NOT_USABLE
    elif t.task[task, 0] == POSITION:
        if count != 3:
            return MISFIT
        for a in range(m):
            raw[a] = values[t.part[first + a]]
    else:
        if count != m:
            return MISFIT
        copy(values, raw, m)
    p.samples[task, 0, width + 3 * m], p.target[task, KNOWN] = 0.0, 1.0
    return 0


@inline_kernel
def to_rotation(quaternion: Array, R: Array) -> bool:
    """Computes the rotation matrix of a quaternion x y z w of any length, row by row; returns False for
    zero."""
    length = math.sqrt(dot(quaternion, quaternion, 4))
    if not length > 0.0:
        return False
    x, y, z, w = (
        quaternion[0] / length,
        quaternion[1] / length,
        quaternion[2] / length,
        quaternion[3] / length,
    )
    R[0], R[1], R[2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    R[3], R[4], R[5] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    R[6], R[7], R[8] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    return True


FIXED, MISFIT, NOT_USABLE, NO_HIERARCHY = -1, -2, -3, -4
"""The faults of a setting: the task follows a fixed motion; the index or the number of values is wrong; a
value is not finite or out of range; the controller has no strict hierarchy."""

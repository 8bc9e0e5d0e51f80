"""Entry point: computes the distances of tasks from their targets, and the velocities of the targets. A robot
without progress is stalled."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import INDICES, NUMBER, VECTOR, inline_kernel, kernel
from himpc.tick.kernel.arrays import Array, IntArray, TickArrays, arrays_of
from himpc.tick.kernel.kinematics import POSITION


@inline_kernel
def error_length(t: TickArrays, p: int, size: float) -> float:
    """Returns the length of the last error of task p, rad, or for a position m divided by `size`."""
    squares = 0.0
    for i in range(t.task[p, 2], t.task[p, 2] + t.task[p, 3]):
        squares += t.error[i] * t.error[i]
    return math.sqrt(squares) / (size if t.task[p, 0] == POSITION else 1.0)


@inline_kernel
def fastest_reference(t: TickArrays, size: float) -> float:
    """Returns the largest velocity of a row of a reference, rad/s, or for a position m/s over `size`."""
    fastest = 0.0
    for p in range(len(t.task)):
        unit = size if t.task[p, 0] == POSITION else 1.0
        for i in range(t.task[p, 2], t.task[p, 2] + t.task[p, 3]):
            fastest = max(fastest, abs(t.motion[1, 0, i]) / unit)
    return fastest


@kernel(VECTOR, INDICES, INDICES, INDICES, NUMBER, VECTOR)
def progress(
    data: Any, where: IntArray, whole: IntArray, whole_where: IntArray, size: float, lengths: Array
) -> float:
    """Writes the length of the last error of each of the first tasks, and returns the largest velocity of a
    row of a reference: rad and rad/s, or for positions m and m/s divided by `size`.

    Args:
        data, where, whole, whole_where: the arena.
        size: see `himpc.controllers.stall_guard.size_of`. lengths: the result, one per task.
    """
    t = arrays_of(data, where, whole, whole_where)
    for p in range(len(lengths)):
        lengths[p] = error_length(t, p, size)
    return fastest_reference(t, size)

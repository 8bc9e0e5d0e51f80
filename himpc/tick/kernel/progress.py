"""Entry point: computes the distances of tasks from their targets, and the velocities of the targets. A robot
without progress is stalled."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import INDICES, VECTOR, inline_kernel, kernel
from himpc.tick.kernel.arrays import Array, IntArray, TickArrays, arrays_of


@inline_kernel
def error_length(t: TickArrays, first: int, last: int) -> float:
    """Returns the length of the last error of the task with the rows first … last − 1, m or rad."""
    squares = 0.0
    for i in range(first, last):
        squares += t.error[i] * t.error[i]
    return math.sqrt(squares)


@inline_kernel
def fastest_reference(t: TickArrays) -> float:
    """Returns the largest velocity of a row of a reference, m/s or rad/s."""
    fastest = 0.0
    for i in range(t.motion.shape[2]):
        fastest = max(fastest, abs(t.motion[1, 0, i]))
    return fastest


@kernel(VECTOR, INDICES, INDICES, INDICES, INDICES, VECTOR)
def progress(
    data: Any, where: IntArray, whole: IntArray, whole_where: IntArray, ends: IntArray, lengths: Array
) -> float:
    """Writes the length of the last error of each task that has an entry in `ends`, m or rad, and returns the
    largest velocity of a row of a reference, m/s or rad/s.

    Args:
        data, where, whole, whole_where: the arena.
        ends: where the rows of each task end. lengths: the result, one per task.
    """
    t = arrays_of(data, where, whole, whole_where)
    first = 0
    for p in range(len(ends)):
        lengths[p], first = error_length(t, first, ends[p]), ends[p]
    return fastest_reference(t)

"""A control period, or parts of it. Python and an exported controller run the same functions."""

from __future__ import annotations

import math
import os
import sys
from typing import Any

from himpc.compilation.compiled import (
    INDICES,
    NUMBER,
    VECTOR,
    WHOLE,
    clock_gettime,
    inline_kernel,
    kernel,
)
from himpc.tick.kernel.arrays import IntArray, arrays_of
from himpc.tick.kernel.finish_tick import finish_tick
from himpc.tick.kernel.linearize import linearize
from himpc.tick.kernel.solve_level import solve_level

LINEARIZE, LEVELS, ONE_LEVEL, FINISH, REMEMBER = 1, 2, 4, 8, 16
"""The parts of a period. The argument `parts` is the sum of the parts to perform."""
ALL_PARTS = LINEARIZE + LEVELS + FINISH + REMEMBER
"""All parts of a period in which the levels are solved once."""
ITERATION = LINEARIZE + LEVELS + FINISH
"""All parts of an iteration of a controller that solves its levels several times in a period."""
NOT_FINITE = -1


@inline_kernel
def _no_clock(stamp: IntArray) -> float:
    """Replaces the clock where the C library has none."""
    return 0.0


@inline_kernel
def _monotonic_us(stamp: IntArray) -> float:
    clock_gettime(_MONOTONIC, stamp.ctypes.data)
    return 1e6 * stamp[0] + 1e-3 * stamp[1]


_MONOTONIC = 6 if sys.platform == "darwin" else 1
_clock = _monotonic_us if os.name == "posix" else _no_clock


@inline_kernel
def perform_parts(
    data: Any, where: IntArray, whole: IntArray, whole_where: IntArray, parts: int, i: int, room: float
) -> int:
    """Performs parts of a control period, in the order in which the constants above are defined.

    Args:
        data, where, whole, whole_where: the arena.
        parts: the parts to perform, a sum of LINEARIZE … REMEMBER. REMEMBER has an effect only with FINISH.
        i: with LEVELS the first level to solve, with ONE_LEVEL the level to solve.
        room: N·m, used with ONE_LEVEL only, see `solve_level`.

    Returns:
        the number of levels if all levels are solved; NOT_FINITE if the problems or the torque are not
        finite; otherwise the level for which no optimum was found. The caller must then apply the level's
        fallback and perform the remaining parts.
    """
    t = arrays_of(data, where, whole, whole_where)
    if parts & LINEARIZE and not linearize(data, where, whole, whole_where):
        return NOT_FINITE
    if parts & ONE_LEVEL and not solve_level(data, where, whole, whole_where, i, room):
        return i
    if parts & LEVELS:
        for level in range(i, t.sizes[4]):
            # The point of an earlier tick is made invalid: if the solver fails at once, no fallback may use
            # it.
            t.U[level, 0, 0] = math.nan
            started = _clock(t.stamp)
            solved = solve_level(data, where, whole, whole_where, level, 0.0)
            t.time_us[level] = _clock(t.stamp) - started
            if not solved:
                return level
            t.fallback[level] = 0.0
    if parts & FINISH and not finish_tick(data, where, whole, whole_where, parts & REMEMBER):
        return NOT_FINITE
    return t.sizes[4]


@kernel(VECTOR, INDICES, INDICES, INDICES, WHOLE, WHOLE, NUMBER)
def control_period(
    data: Any, where: IntArray, whole: IntArray, whole_where: IntArray, parts: int, i: int, room: float
) -> int:
    """Python's entry to `perform_parts`; an exported controller calls the same function."""
    return perform_parts(data, where, whole, whole_where, parts, i, room)

"""The levels of the cascade, from one of them on."""

from __future__ import annotations

import math
from typing import Any

from himpc.compilation.compiled import always_inline_kernel, inline_kernel
from himpc.tick.kernel.arrays import Whole
from himpc.tick.kernel.arrays_of import arrays_of
from himpc.tick.kernel.solve_level import solve_level


@inline_kernel
def no_clock(stamp: Whole) -> float:
    """Replaces the clock where there is none, as in an exported kernel, which calls no library."""
    return 0.0


@always_inline_kernel
def solve_levels(data: Any, where: Whole, whole: Whole, whole_where: Whole, first: int, clock: Any) -> int:
    """Solves the problems of the cascade from level `first` on. Returns the first level for which no optimum
    was found within what is left of the budget, or the number of levels.

    clock: a compiled function, (scratch) → the time in µs. `solve_levels` is always inlined: otherwise the
        code would contain an address of `clock`, and could not be stored on disk.
    """
    t = arrays_of(data, where, whole, whole_where)
    for i in range(first, t.sizes[4]):
        # If the solver fails at once, the point of an earlier tick must not be used as a direction.
        t.U[i, 0, 0] = math.nan
        started = clock(t.stamp)
        solved = solve_level(data, where, whole, whole_where, i, 0.0)
        t.time_us[i] = clock(t.stamp) - started
        if not solved:
            return i
        t.rung[i] = 0.0
    return t.sizes[4]

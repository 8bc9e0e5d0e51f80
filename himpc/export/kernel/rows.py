"""The rows of a tick and their values."""

from __future__ import annotations

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.arrays import DIRECTED, Array, TickArrays
from himpc.tick.kernel.bounds import LevelBounds


@inline_kernel
def joint_rows(t: TickArrays) -> int:
    """Returns the number of rows that bound single joints. The rows of distances follow them."""
    return len(t.L) - t.sizes[DIRECTED] * len(t.fixed)


@inline_kernel
def constraints_of(t: TickArrays, value: Array) -> LevelBounds:
    """Returns the rows of this tick; their values are written to `value`."""
    return LevelBounds(t.L, t.lower, t.upper, value, t.length, t.direction, joint_rows(t))

"""The arrays that an exported controller has besides those of a tick."""

from __future__ import annotations

from typing import Annotated, NamedTuple, get_type_hints

from himpc.compilation.compiled import always_inline_kernel
from himpc.compilation.views import matrices, matrix, vector
from himpc.tick.kernel.arrays import Array, TickArrays, Whole


class LoopArrays(NamedTuple):
    """Settings that can change while the robot moves, targets, and scratch of the fallbacks; each annotation
    contains the shape, the unit and a description.

    Sizes: as for `TickArrays`, where r counts all levels, also those that are off; D = 2ʳ choices of levels;
    V numbers of a target's value, W numbers of a sample and K numbers of the caps, see
    `himpc.tick.kernel.target.roll`.
    """

    setup: Annotated[Array, "8", "1", "constants of the export, see MOST and the names after it"]
    state: Annotated[Array, "4", "1", "the memory, see STARTED and the names after it"]
    goal: Annotated[Array, "8 n", "N·m, rad/s, rad, rad/s²", "the desired limits, rows as in `limits`"]
    tau_limit: Annotated[Array, "n", "N·m", "largest torque of each joint; a larger reading is reduced to it"]
    Q: Annotated[Array, "M", "s⁴/m²", "weight of each row's residual"]
    R: Annotated[Array, "r n", "1/(N·m)²", "weight of the increments of each level"]
    enabled: Annotated[Array, "r", "1", "1 for a level that is on"]
    damped: Annotated[Array, "D", "1", "whether the damping level is added to this choice of levels"]
    table: Annotated[Array, "r 8", "1", "the table of all levels, columns as in `level`"]
    order: Annotated[Array, "r", "1", "the levels, highest priority first"]
    place: Annotated[Array, "r", "1", "index of each level among the solved levels; -1 if it is off"]
    weight: Annotated[Array, "M", "1", "share of Q in force for a row that fades in, 0 … 1"]
    target: Annotated[
        Array, "T 4", "1", "of each task: draggable, and the numbers of rows, values and known samples"
    ]
    raw: Annotated[Array, "T V", "m, rad, 1", "the raw target, which is not filtered"]
    caps: Annotated[Array, "T K", "m/s, m/s², m/s³", "speed, acceleration and jerk limits; then scratch"]
    samples: Annotated[Array, "T N1 W", "m, m/s, m/s²", "the filtered target at this and the next periods"]
    # Scratch.
    lowest: Annotated[Array, "b n", "N·m", "lower bounds before a fallback has widened them"]
    highest: Annotated[Array, "b n", "N·m", "upper bounds before a fallback has widened them"]
    size: Annotated[Array, "b n", "N·m", "sum of the magnitudes of each row's terms"]
    wanted: Annotated[Array, "N n", "N·m", "the point that the solver reached"]
    trial: Annotated[Array, "N n", "N·m", "increments of a fallback"]
    w: Annotated[Array, "N n", "N·m", "values of velocity rows"]
    low: Annotated[Array, "N n", "N·m", "least values of velocity rows from which later rows can be met"]
    high: Annotated[Array, "N n", "N·m", "largest values of velocity rows from which later rows can be met"]
    before: Annotated[Array, "r N n", "N·m", "increments of the previous iteration"]
    weights: Annotated[Array, "n", "1/(N·m)²", "R of one level"]
    # A constant of the export.
    widest: Annotated[
        Array,
        "4 n",
        "N·m, rad/s, rad",
        "largest limits that a setting may give: torque, velocity, both ends",
    ]


SHAPES: dict[str, str] = {
    name: hint.__metadata__[0] for name, hint in get_type_hints(LoopArrays, include_extras=True).items()
}
"""The shape of every array by name, in the order of the arrays."""

MOST, TOLERANCE, ON_ACCELERATION, LEVELS, DAMPS, BUDGET, SIMPLE = range(7)
"""Indices of `setup`: largest number of iterations and their tolerance (N·m), see `NHIMPC`; whether R weighs
M̄⁻¹Δτ; number of levels and whether the last one is the damping level; largest number of multiplications in a
tick; whether levels form a strict hierarchy, which is required to switch levels."""
STARTED, TICKS, FADING = range(3)
"""Indices of `state`: whether the previous tick is stored, number of ticks since the reset, and whether rows
fade in."""
DRAGGABLE, ROWS, WIDTH, KNOWN = range(4)
"""Columns of `target`. KNOWN is 0 for a target at rest."""


def sizes_of(n: int, N: int, M: int, r: int, T: int, b: int) -> dict[str, int]:
    """Returns the value of each letter in the shapes."""
    widest = max(n, 3)
    return {
        "n": n,
        "N": N,
        "N1": N + 1,
        "M": M,
        "r": r,
        "T": T,
        "b": b,
        "D": 2**r,
        "V": max(9, widest),
        "W": max(19, 4 * widest + 1),
        "K": 3 + 3 * widest,
    }


@always_inline_kernel
def loop_arrays_of(loop: Array, where: Whole, t: TickArrays) -> LoopArrays:
    """Returns all arrays as views.

    Args:
        loop: the numbers of all arrays.
        where: index in `loop` at which each array begins, in the order of `SHAPES`.
        t: determines the sizes.
    """
    N, n = t.fixed.shape
    M, T, b, r = t.sizes[2], len(t.task), len(t.L), int(loop[where[0] + LEVELS])
    widest = max(n, 3)
    return LoopArrays(
        vector(loop, where[0], 8),
        vector(loop, where[1], 4),
        matrix(loop, where[2], 8, n),
        vector(loop, where[3], n),
        vector(loop, where[4], M),
        matrix(loop, where[5], r, n),
        vector(loop, where[6], r),
        vector(loop, where[7], 1 << r),
        matrix(loop, where[8], r, 8),
        vector(loop, where[9], r),
        vector(loop, where[10], r),
        vector(loop, where[11], M),
        matrix(loop, where[12], T, 4),
        matrix(loop, where[13], T, max(9, widest)),
        matrix(loop, where[14], T, 3 + 3 * widest),
        matrices(loop, where[15], T, N + 1, max(19, 4 * widest + 1)),
        matrix(loop, where[16], b, n),
        matrix(loop, where[17], b, n),
        matrix(loop, where[18], b, n),
        matrix(loop, where[19], N, n),
        matrix(loop, where[20], N, n),
        matrix(loop, where[21], N, n),
        matrix(loop, where[22], N, n),
        matrix(loop, where[23], N, n),
        matrices(loop, where[24], r, N, n),
        vector(loop, where[25], n),
        matrix(loop, where[26], 4, n),
    )

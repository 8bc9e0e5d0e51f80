"""The arrays that an exported controller has besides those of a tick."""

from __future__ import annotations

from collections import namedtuple
from typing import Annotated, NamedTuple

from himpc.compilation.compiled import always_inline_kernel
from himpc.compilation.views import arrays_in, shapes_of
from himpc.tick.kernel.arrays import Array, IntArray, TickArrays


class LoopArrays(NamedTuple):
    """Settings that can change while the robot moves, targets, and scratch of the fallbacks; each annotation
    contains the shape, the unit and a description.

    Sizes: as for `TickArrays`, where r counts all levels, also those that are off; D = 2ʳ choices of levels;
    V numbers of a target's value, W numbers of a sample and K numbers of the caps, see
    `himpc.tick.kernel.target.roll`.
    """

    setup: Annotated[Array, "10", "1", "constants of the export, see MOST and the names after it"]
    state: Annotated[Array, "6", "1", "the memory, see STARTED and the names after it"]
    goal: Annotated[Array, "8 n", "N·m, rad/s, rad, rad/s²", "the desired limits, rows as in `limits`"]
    tau_limit: Annotated[Array, "n", "N·m", "largest torque of each joint; a larger reading is reduced to it"]
    Q: Annotated[Array, "M", "s⁴/m²", "weight of each row's residual"]
    R: Annotated[Array, "r n", "1/(N·m)²", "weight of the increments of each level"]
    enabled: Annotated[Array, "r", "1", "1 for a level that is on"]
    damped: Annotated[Array, "D", "1", "whether the damping level is added to this choice of levels"]
    table: Annotated[Array, "r 8", "1", "the table of all levels, columns as in `level`"]
    order: Annotated[Array, "r", "1", "the levels, highest priority first"]
    solved_index: Annotated[Array, "r", "1", "index of each level among the solved levels; -1 if it is off"]
    weight: Annotated[Array, "M", "1", "share of Q in force for a row that fades in, 0 … 1"]
    target: Annotated[
        Array, "T 4", "1", "of each task: draggable, and the numbers of rows, values and known samples"
    ]
    raw: Annotated[Array, "T V", "m, rad, 1", "the raw target, which is not filtered"]
    caps: Annotated[Array, "T K", "m/s, m/s², m/s³", "speed, acceleration and jerk limits; then scratch"]
    samples: Annotated[Array, "T N1 W", "m, m/s, m/s²", "the filtered target at this and the next periods"]
    # The guard, see `himpc.controllers.stall_guard`.
    carried: Annotated[Array, "n n", "1", "whether the motor of joint j carries joint k, entry [k, j]"]
    v_limit: Annotated[Array, "n", "rad/s", "velocity limits of the robot"]
    v_ramped: Annotated[Array, "n", "rad/s", "velocity limits in force before the guard has lowered them"]
    errors: Annotated[Array, "T", "m, rad", "length of the error of each task that is solved"]
    due: Annotated[Array, "T", "m, rad", "the errors that the tasks should have reached by now"]
    stall: Annotated[Array, "2", "1, m", "numbers about the stall, see STALL_SHARE"]
    load: Annotated[Array, "n", "1", "mean load of each joint"]
    mean: Annotated[Array, "n", "rad/s", "mean velocity of each joint"]
    tau_before: Annotated[Array, "n", "N·m", "the torque that acted one period ago"]
    wound: Annotated[Array, "n", "1", "change of the torque of joints that are still"]
    windup: Annotated[Array, "2", "1", "numbers about the wind-up, see TREND"]
    # Scratch.
    free_limit: Annotated[Array, "n", "rad/s", "velocity limits less the margin of a guarded robot"]
    largest_torque: Annotated[Array, "n", "N·m", "the larger torque limit in force"]
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


SHAPES = shapes_of(LoopArrays, Array)
"""The shape of every array by name, in the order of the arrays."""

MOST, TOLERANCE, ON_ACCELERATION, LEVELS, DAMPS, BUDGET, SIMPLE, GUARD, MARGIN, LARGEST_ERROR = range(10)
"""Indices of `setup`: largest number of iterations and their tolerance (N·m), see `NHIMPC`; whether R weighs
M̄⁻¹Δτ; number of levels and whether the last one is the damping level; largest number of multiplications in a
tick; whether levels form a strict hierarchy, which is required to switch levels; the kind of guard; share of
the velocity limits that a guarded robot does not use; the largest error on which tasks act (m, rad)."""
UNGUARDED, STALL, PRESSING = range(3)
"""The kinds of guards: none, `StallGuard` and `WindupGuard`."""
STARTED, TICKS, FADING, GUARDED, ERRORS, FASTEST = range(6)
"""Indices of `state`: whether the previous tick is stored, number of ticks since the reset, whether rows fade
in, whether the guard has data, number of known errors, and the largest velocity of a reference."""
DRAGGABLE, ROWS, WIDTH, KNOWN = range(4)
"""Columns of `target`. KNOWN is 0 for a target at rest."""
LoopSizes = namedtuple("LoopSizes", "n N N1 M r T b D V W K")
"""The values of the letters in the shapes, see `LoopArrays`."""


def sizes_of(n: int, N: int, M: int, r: int, T: int, b: int) -> LoopSizes:
    """Returns the values of the letters."""
    widest = max(n, 3)
    return LoopSizes(n, N, N + 1, M, r, T, b, 1 << r, max(9, widest), max(19, 4 * widest + 1), 3 + 3 * widest)


_compiled_sizes = always_inline_kernel(sizes_of)
_loop_arrays = arrays_in(LoopArrays, SHAPES, {})


@always_inline_kernel
def loop_arrays_of(loop: Array, where: IntArray, t: TickArrays) -> LoopArrays:
    """Returns all arrays as views. `loop` contains the numbers of all arrays, `where` the index at which each
    array begins, in the order of `SHAPES`; the arrays of a tick determine the sizes."""
    N, n = t.fixed.shape
    s = _compiled_sizes(n, N, t.sizes[2], int(loop[where[0] + LEVELS]), len(t.task), len(t.L))
    return _loop_arrays(loop, where, where, where, s)

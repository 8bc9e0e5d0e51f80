"""Every array of a tick: its name, shape and unit, and which files write and read it. The views that compiled
functions use follow from this table."""

from __future__ import annotations

from collections import namedtuple
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.compilation.compiled import always_inline_kernel
from himpc.compilation.views import arrays_in, shapes_of, vector

Array = NDArray[np.float64]
IntArray = Any
"""An array of whole numbers, NDArray[np.intp]. Type checkers do not know that its elements are numbers."""


class TickArrays(NamedTuple):
    """The arrays of a tick. Each annotation contains the shape, the unit, and "files that write the array →
    files that read it"; files that write an array may also read it.

    The units are those of revolute joints and of positions. For prismatic joints, read m for rad and N for
    N·m; for tasks that are angles, read rad for m.

    Sizes: n joints, N knots, N1 = N + 1; M rows of all tasks, m of those that are solved; r levels; T tasks;
    F frames; G rows of tasks that Python computes; J placements, of the world and of all joints, with those
    that follow others; b rows of bounds, N per constraint; g constraints with directions of their own, whose
    rows are the last ones; w = N · n coordinates of a level; k = w + 1 active rows at most: w, and a new row
    that replaces one of them.
    """

    # The input of a tick.
    q: Annotated[
        Array,
        "n",
        "rad",
        "kinematics tick → distance_rows fallbacks finish_tick linearize python_bounds python_rows "
        "solve_level",
    ]
    v: Annotated[
        Array,
        "n",
        "rad/s",
        "kinematics tick → distance_rows fallbacks finish_tick linearize python_bounds python_rows",
    ]
    tau_0: Annotated[Array, "n", "N·m", "tick → finish_tick gather linearize python_bounds"]
    x_d: Annotated[Array, "M", "m, rad", "configure kinematics linearize preview_writer → gather"]
    R_d: Annotated[Array, "T 3 3", "1", "configure kinematics preview_writer → finish_tick linearize"]
    # x_d(k+j) − x_d(k), ẋ_d and ẍ_d
    motion: Annotated[Array, "3 N1 M", "m, m/s, m/s²", "configure linearize preview_writer → gather progress"]
    python_jacobian: Annotated[Array, "N1 G n", "m, 1", "python_rows → linearize"]
    curve: Annotated[Array, "M 4", "m, rad", "configure → linearize"]
    pace: Annotated[Array, "T 2", "rad/s, rad", "configure → linearize"]
    # The memory of the previous tick.
    q_was: Annotated[Array, "n", "rad", "finish_tick tick → linearize python_rows"]
    v_was: Annotated[
        Array, "n", "rad/s", "finish_tick tick → distance_rows fallbacks linearize python_bounds python_rows"
    ]
    x_dot_was: Annotated[Array, "M", "m/s", "finish_tick linearize → itself"]
    path: Annotated[Array, "N1 n", "rad", "finish_tick kinematics tick → linearize python_rows"]
    warm_multiplier: Annotated[Array, "r k", "1/N·m", "finish_tick solve_level problems → itself"]
    U_was: Annotated[Array, "r N n", "N·m", "finish_tick problems tick → fallbacks"]
    # The settings.
    M_bar: Annotated[
        Array,
        "n",
        "kg·m²",
        "kinematics problems tables tick → distance_rows fallbacks finish_tick linearize python_bounds",
    ]
    K_p: Annotated[Array, "M", "1/s²", "tables → linearize"]
    K_v: Annotated[Array, "M", "1/s", "tables → linearize"]
    root_Q: Annotated[Array, "M", "s²/m", "tables → fallbacks finish_tick solve_level"]
    C: Annotated[Array, "M N", "s²/m", "tables → fallbacks finish_tick solve_level"]
    S: Annotated[Array, "M N N", "s⁴/m²", "tables → solve_level"]
    on_velocity: Annotated[Array, "N M", "1/s", "tables → linearize"]
    on_acceleration: Annotated[Array, "N M", "1", "tables → linearize"]
    rho: Annotated[Array, "r", "1/(N·m)²", "tables → fallbacks solve_level"]
    metric: Annotated[Array, "r n", "1", "tables → fallbacks solve_level"]
    R: Annotated[Array, "r n", "1/(N·m)²", "tables → finish_tick"]
    accuracy: Annotated[Array, "r", "1", "tables → solve_level"]
    limits: Annotated[
        Array, "8 n", "N·m, rad/s, rad, rad/s²", "configure problems → gather finish_tick linearize"
    ]
    L: Annotated[Array, "b N", "1", "configure problems → distance_rows fallbacks solve_level tick"]
    direction: Annotated[
        Array, "g n n", "1", "distance_rows problems python_bounds → finish_tick solve_level"
    ]
    approach: Annotated[Array, "N", "1", "tables → distance_rows linearize"]
    scalars: Annotated[
        Array,
        "5",
        "s, m",
        "configure finish_tick kinematics preview_writer problems tables tick → "
        "distance_rows fallbacks linearize python_bounds",
    ]
    # The robot.
    rotation: Annotated[Array, "J 3 3", "1", "configure → linearize"]
    translation: Annotated[Array, "J 3", "m", "configure → linearize"]
    axis: Annotated[Array, "J 3", "1", "configure → linearize"]
    factor: Annotated[Array, "J", "1", "configure → linearize"]
    frame_rotation: Annotated[Array, "F 3 3", "1", "configure → linearize"]
    frame_translation: Annotated[Array, "F 3", "m", "configure → linearize"]
    # The results of a tick. They are adjacent: a plan copies them in one operation.
    tau: Annotated[Array, "n", "N·m", "finish_tick → gather tick"]
    U: Annotated[
        Array, "r N n", "N·m", "control_period fallbacks solve_level → finish_tick problems tables tick"
    ]
    predicted: Annotated[Array, "N1 n", "rad", "finish_tick → tick"]
    value: Annotated[Array, "M", "m, rad", "linearize python_rows → gather kinematics tick"]
    error: Annotated[Array, "M", "m, rad", "linearize python_rows → gather kinematics progress tick"]
    R_now: Annotated[Array, "T 3 3", "1", "linearize python_rows → finish_tick kinematics tick"]
    lower: Annotated[
        Array,
        "b n",
        "N·m",
        "distance_rows fallbacks linearize problems python_bounds → solve_level tables tick",
    ]
    upper: Annotated[
        Array, "b n", "N·m", "distance_rows fallbacks linearize problems python_bounds → solve_level tick"
    ]
    stopping: Annotated[Array, "2 n", "1", "linearize → finish_tick tick"]
    cost: Annotated[Array, "r", "1", "finish_tick → gather problems"]
    kkt: Annotated[Array, "r", "1", "fallbacks solve_level → gather problems"]
    leak: Annotated[Array, "r", "m/s²", "finish_tick → gather problems"]
    multiplier: Annotated[Array, "r k", "1/N·m", "solve_level → finish_tick problems"]
    slack: Annotated[Array, "r k", "N·m", "solve_level → problems"]
    # Further data for telemetry; NaN stands for missing data.
    quaternion: Annotated[Array, "T 4", "1", "finish_tick → gather"]
    quaternion_d: Annotated[Array, "T 4", "1", "finish_tick → gather"]
    delta_tau: Annotated[Array, "n", "N·m", "finish_tick → gather"]
    at_bound: Annotated[Array, "n", "1", "finish_tick → gather"]
    priority_leak: Annotated[Array, "1", "m/s²", "finish_tick → gather"]
    active: Annotated[Array, "r", "1", "finish_tick → gather"]
    fallback: Annotated[Array, "r", "1", "control_period fallbacks tick → gather finish_tick problems"]
    time_us: Annotated[Array, "r", "µs", "control_period fallbacks → gather problems tick"]
    nothing: Annotated[Array, "1", "1", "configure → gather"]
    # Scratch.
    placed: Annotated[Array, "J 12", "1, m", "linearize → itself"]
    axis_now: Annotated[Array, "J 3", "1", "linearize → itself"]
    point: Annotated[Array, "F 3", "m", "linearize → itself"]
    x_dot: Annotated[Array, "M", "m/s", "linearize → finish_tick"]
    B: Annotated[
        Array,
        "N M n",
        "m/s²/N·m",
        "linearize problems → fallbacks finish_tick solve_level kinematics tick",
    ]
    free: Annotated[Array, "N M", "m/s²", "linearize problems → fallbacks finish_tick solve_level tick"]
    Q: Annotated[Array, "N n n", "1", "solve_level → itself"]
    reflector: Annotated[Array, "N n n", "1", "solve_level → itself"]
    projected_jacobian: Annotated[Array, "N M n", "m/s²/N·m", "solve_level → itself"]
    fixed: Annotated[Array, "N n", "N·m", "solve_level → distance_rows finish_tick linearize"]
    e_0: Annotated[Array, "N M", "1", "solve_level → itself"]
    e_1: Annotated[Array, "N M", "1", "finish_tick solve_level → itself"]
    B_U: Annotated[Array, "N M", "m/s²", "solve_level → itself"]
    H: Annotated[Array, "w w", "1/(N·m)²", "solve_level → itself"]
    low: Annotated[Array, "b n", "N·m", "solve_level → itself"]
    high: Annotated[Array, "b n", "N·m", "solve_level → itself"]
    reached: Annotated[Array, "b n", "N·m", "solve_level → itself"]
    length: Annotated[Array, "b n", "N·m", "solve_level → itself"]
    effect: Annotated[Array, "r N M", "m/s²", "finish_tick → itself"]
    normal: Annotated[Array, "k w", "1", "solve_level → itself"]
    scaled_normal: Annotated[Array, "k w", "N·m", "solve_level → itself"]
    orthonormal_basis: Annotated[Array, "k w", "1", "solve_level → itself"]
    cholesky_factor: Annotated[Array, "k k", "N·m", "solve_level → itself"]
    target: Annotated[Array, "k", "N·m", "solve_level → itself"]
    violation: Annotated[Array, "k", "N·m", "solve_level → itself"]
    trial_multiplier: Annotated[Array, "k", "1/N·m", "solve_level → itself"]
    change: Annotated[Array, "k", "1/N·m", "solve_level → itself"]
    x: Annotated[Array, "w", "N·m", "solve_level → itself"]
    z: Annotated[Array, "w", "N·m", "linearize solve_level → itself"]
    slope: Annotated[Array, "w", "1/N·m", "linearize solve_level → itself"]
    ideal: Annotated[Array, "w", "1", "solve_level → itself"]
    size: Annotated[Array, "2", "1/N·m, 1", "solve_level → itself"]
    budget: Annotated[Array, "1", "1", "solve_level problems tick → itself"]
    sizes: Annotated[
        IntArray,
        "13",
        "1",
        "configure tables → control_period distance_rows fallbacks finish_tick linearize solve_level",
    ]
    # The memory, and whether `x_dot_was` and `U_was` are known.
    known: Annotated[
        IntArray, "2", "1", "finish_tick kinematics linearize problems tick → fallbacks python_rows"
    ]
    warm_row: Annotated[IntArray, "r k", "1", "finish_tick solve_level problems → itself"]
    warm_joint: Annotated[IntArray, "r k", "1", "finish_tick solve_level problems → itself"]
    warm_count: Annotated[IntArray, "r", "1", "finish_tick solve_level problems tick → itself"]
    # The settings.
    task: Annotated[IntArray, "T 4", "1", "configure → finish_tick linearize"]
    part: Annotated[IntArray, "M", "1", "configure → linearize"]
    law: Annotated[IntArray, "T", "1", "configure preview_writer → linearize"]
    row_knots: Annotated[IntArray, "M", "1", "tables → fallbacks finish_tick solve_level"]
    # The bit of `at_bound` of each row.
    bit: Annotated[IntArray, "b", "1", "configure problems → finish_tick"]
    level: Annotated[IntArray, "r 8", "1", "tables → fallbacks finish_tick solve_level"]
    # The robot.
    parent: Annotated[IntArray, "J", "1", "configure → linearize"]
    is_revolute: Annotated[IntArray, "J", "1", "configure → linearize"]
    column: Annotated[IntArray, "J", "1", "configure → linearize"]
    frame_joint: Annotated[IntArray, "F", "1", "configure → linearize"]
    # Further results of a tick.
    active_row: Annotated[IntArray, "r k", "1", "solve_level → finish_tick problems"]
    active_joint: Annotated[IntArray, "r k", "1", "solve_level → finish_tick problems"]
    active_count: Annotated[IntArray, "r", "1", "fallbacks solve_level → finish_tick problems"]
    left: Annotated[IntArray, "r", "1", "solve_level → problems"]
    # Scratch.
    end: Annotated[IntArray, "N", "1", "solve_level → itself"]
    start: Annotated[IntArray, "N", "1", "solve_level → itself"]
    offset: Annotated[IntArray, "N1", "1", "solve_level → itself"]
    rest: Annotated[IntArray, "N1", "1", "solve_level → itself"]
    held_row: Annotated[IntArray, "k", "1", "solve_level → itself"]
    held_joint: Annotated[IntArray, "k", "1", "solve_level → itself"]
    held_side: Annotated[IntArray, "k", "1", "solve_level → itself"]
    stamp: Annotated[IntArray, "2", "s, ns", "control_period → itself"]


NUMBERS, WHOLES = shapes_of(TickArrays, Array), shapes_of(TickArrays, IntArray)
"""The shape of every array, by name: arrays of real numbers, and arrays of whole numbers."""
AT, WHOLE_AT = ({name: index for index, name in enumerate(shapes)} for shapes in (NUMBERS, WHOLES))
"""The index of each array in `Arena.where` and in `Arena.whole_where`, by name."""
Sizes = namedtuple("Sizes", "n N N1 M r T F G J b g w k")
"""The values of the letters in the shapes, see `TickArrays`."""


def sizes_of(s: IntArray) -> Sizes:
    """Returns the values of the letters for the numbers in the array `sizes`."""
    n, N, M, r, T, F, b, w, G = s[0], s[1], s[2], max(s[4], 1), s[5], s[6], s[7], s[8], s[10]
    return Sizes(n, N, N + 1, M, r, T, F, G, s[12], b, max(s[11], 1), w, w + 1)


_compiled_sizes = always_inline_kernel(sizes_of)
_tick_arrays = arrays_in(TickArrays, NUMBERS, WHOLES)
_SIZES, _COUNT = WHOLE_AT["sizes"], int(WHOLES["sizes"])


@always_inline_kernel
def arrays_of(data: Array, where: IntArray, whole: IntArray, whole_where: IntArray) -> TickArrays:
    """Returns all arrays of an arena as views. Views that a compiled function does not use cost no time."""
    s = _compiled_sizes(vector(whole, whole_where[_SIZES], _COUNT))
    return _tick_arrays(data, where, whole, whole_where, s)


PERIOD, T_S, REACTION, NOW, PULL = range(5)
"""Indices of `scalars`: duration of the previous period (s), duration of this period (s), the reaction of
`viable_speed`, t, and the largest error on which tasks act."""
DIRECTED = 11
"""Index in `sizes` of the number of constraints with directions of their own. Their rows are the last
ones."""

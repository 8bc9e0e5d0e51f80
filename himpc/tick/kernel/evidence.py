"""The evidence of a tick: costs, leaks, active bounds, and orientations as quaternions."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.constants import AT_POSITION, AT_VELOCITY
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.cascade import OWN_FIRST, OWN_LAST
from himpc.tick.kernel.kinematics import ORIENTATION


@inline_kernel
def cost_of(e: Array, U: Array, R: Array, first: int, last: int, row_knots: IntArray, knots: int) -> float:
    """Returns the value of (32a) or (34a): Σ ‖Q^½ e‖² + ‖U‖²_R over a level's own knots."""
    total = 0.0
    for i in range(first, last):
        for k in range(row_knots[i]):
            total += e[k, i] * e[k, i]
    for j in range(knots):
        for a in range(U.shape[1]):
            total += R[a] * U[j, a] * U[j, a]
    return total


@inline_kernel
def leak_of(index: int, levels: IntArray, effect: Array) -> float:
    """Returns ‖J_p M̄⁻¹(Δτ_i − Δτ_p)‖∞ over knots and levels p above level i; effect: J M̄⁻¹ Δτ, (r, N,
    m)."""
    most = 0.0
    N = effect.shape[1]
    for p in range(index):
        for j in range(N):
            for i in range(levels[p, OWN_FIRST], levels[p, OWN_LAST]):
                most = max(most, abs(effect[index, j, i] - effect[p, j, i]))
    return most


@inline_kernel
def bounds_met(
    count: int,
    row: IntArray,
    column: IntArray,
    multiplier: Array,
    stopping: Array,
    bits: IntArray,
    direction: Array,
    plain: int,
    at_bound: Array,
) -> None:
    """Adds the bits of a level's active rows to those of the joints, (n,) integers.

    Args:
        count, row, column, multiplier: the active rows.
        stopping: (2, n), see `bounds`.
        bits: the bit of every row.
        direction, plain: see `LevelBounds`; a row with a direction sets the bit of all joints that it bounds.
        at_bound: the result.
    """
    N = (len(bits) - plain) // len(direction)
    for p in range(count):
        a, bit = column[p], bits[row[p]]
        if row[p] >= plain:
            along = direction[(row[p] - plain) // N, a]
            for joint in range(at_bound.size):
                if along[joint] != 0.0:
                    at_bound[joint] = float(int(at_bound[joint]) | bit)
            continue
        if bit == AT_VELOCITY and stopping[1 if multiplier[p] > 0.0 else 0, a] > 0.0:
            bit = AT_POSITION
        at_bound[a] = float(int(at_bound[a]) | bit)


@inline_kernel
def quaternions(task: IntArray, R: Array, out: Array) -> None:
    """Computes unit quaternions x y z w, w ≥ 0, of rotations (T, 3, 3), for orientation tasks."""
    for t in range(len(task)):
        if task[t, 0] == ORIENTATION:
            quaternion(R[t], out[t])


@inline_kernel
def quaternion(R: Array, out: Array) -> None:
    """Computes the quaternion x y z w of a rotation, w ≥ 0. Its largest component is computed by a square
    root."""
    xx, yy, zz = R[0, 0], R[1, 1], R[2, 2]
    w, x, y, z = 1.0 + xx + yy + zz, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    if w < 1.0:
        if xx >= yy and xx >= zz:
            w, x, y, z = x, 1.0 + xx - yy - zz, R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]
        elif yy >= zz:
            w, x, y, z = y, R[0, 1] + R[1, 0], 1.0 + yy - xx - zz, R[1, 2] + R[2, 1]
        else:
            w, x, y, z = z, R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], 1.0 + zz - xx - yy
    share = math.copysign(1.0 / math.sqrt(x * x + y * y + z * z + w * w), w)
    out[0], out[1], out[2], out[3] = share * x, share * y, share * z, share * w

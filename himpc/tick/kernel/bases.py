"""The directions that (33) leaves free at each knot: orthonormal coordinates in which the cascade is
triangular."""

from __future__ import annotations

import math

from himpc.compilation.compiled import inline_kernel
from himpc.constants import RANK_TOLERANCE
from himpc.tick.kernel.arrays import Array
from himpc.tick.kernel.linear import dot, subtract


@inline_kernel
def no_directions(Q: Array) -> None:
    """Sets Q (n, n) of a knot to the identity, its value before the first level."""
    Q[:] = 0.0
    for a in range(len(Q)):
        Q[a, a] = 1.0


@inline_kernel
def projected_rows(
    B: Array, metric: Array, reflector: Array, count: int, first: int, last: int, projected_jacobian: Array
) -> None:
    """Transforms rows of one knot to the knot's coordinates: projected_i = (b_i ∘ metric) Q.

    Args:
        B: Ĵ M̄⁻¹ of the knot, (m, n).
        metric: √(ρ/R) per joint; with U = metric ∘ V the effort is ρ‖V‖².
        reflector, count: the reflections, and their number; Q is their product.
        first, last: range of rows.
        projected_jacobian: (m, n), the result.
    """
    n = metric.size
    for i in range(first, last):
        row = projected_jacobian[i]
        for a in range(n):
            row[a] = B[i, a] * metric[a]
        for c in range(count):
            reflect(reflector[c], row, c)


@inline_kernel
def reflect(v: Array, x: Array, first: int) -> None:
    """Computes x ← (1 − v vᵀ) x from index `first` on; ‖v‖² = 2."""
    n = x.size - first
    subtract(dot(v[first:], x[first:], n), v[first:], x[first:], n)


@inline_kernel
def take_directions(
    projected_jacobian: Array, first: int, last: int, count: int, reflector: Array, Q: Array
) -> int:
    """Performs a Householder QR of a level's rows at one knot, within the directions that the levels above
    leave. Returns the number of directions that the levels above and this level use. The other directions
    have no effect on the level and are left to lower levels.

    The row with the largest remainder is always used next, so the remainder shows the rank: a direction whose
    effect is less than RANK_TOLERANCE of the size of the rows is left to lower levels.

    Args:
        projected_jacobian: (m, n), the level's rows in the old coordinates; afterwards in the new ones.
        first, last: range of rows.
        count: number of directions that the levels above use.
        reflector: (n, n), one reflection is added for each direction.
        Q: (n, n), its columns are the directions; the first `count` columns do not change.
    """
    n = len(Q)
    size = 0.0
    for i in range(first, last):
        size += dot(projected_jacobian[i], projected_jacobian[i], n)
    # No row is chosen twice. After its direction is used, only rounding errors remain of the row.
    for _ in range(min(last - first, n - count)):
        best, most = first, -1.0
        for i in range(first, last):
            left = dot(projected_jacobian[i, count:], projected_jacobian[i, count:], n - count)
            if left > most:
                best, most = i, left
        if not most > RANK_TOLERANCE * RANK_TOLERANCE * size:
            break
        v, row = reflector[count], projected_jacobian[best]
        for a in range(count, n):
            v[a] = row[a]
        v[count] += math.copysign(math.sqrt(most), row[count])
        scale = math.sqrt(2.0 / dot(v[count:], v[count:], n - count))
        for a in range(count, n):
            v[a] *= scale
        for i in range(first, last):
            reflect(v, projected_jacobian[i], count)
        for a in range(count + 1, n):
            row[a] = 0.0
        for a in range(n):
            reflect(v, Q[a], count)
        count += 1
    return count

"""The active rows, which hold as equalities: their orthonormal basis, their multipliers, and the point that
they determine. HIMPC's levels and HTMPC's QPs use this module."""

from __future__ import annotations

import math
from typing import NamedTuple

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.linear import backward, close_gap, copy, dot, forward, split, subtract

_DEPENDENT = 1e-10
"""A row is linearly dependent on the active rows if its part orthogonal to the active rows is less than this
share of the row."""


class Quadratic(NamedTuple):
    """The cost ½‖Fᵀx − ideal‖² + ½ρ‖x'‖² of d coordinates x and D − d further ones, x'.

    Attributes:
        F: the Cholesky factor of the Hessian of x, (d, d).
        ideal: the optimum without any row, in scaled coordinates Fᵀx, (d,).
        share: 1/√ρ.
        d, D: see above.
    """

    F: Array
    ideal: Array
    share: float
    d: int
    D: int


class ActiveSet(NamedTuple):
    """The k active rows a'x ≤ b. The arrays have space for more rows.

    Attributes:
        row, joint, side: the indices of each row, and its active bound: the upper (1) or the lower one (−1);
            0 marks a row that stays an equality whatever its multiplier is.
        normal: the vector a of each row, in the coordinates of the cost.
        scaled_normal: a in the coordinates in which the Hessian is one: F⁻¹ a, a'/√ρ.
        orthonormal_basis, cholesky_factor: orthonormal rows, and the lower triangle of
            scaled_normal = cholesky_factor · orthonormal_basis.
        target: the bound b of each row.
        multiplier: the multiplier of each row, positive at an upper bound.
        violation: the violation of each row at the point.
        change: scratch.
    """

    row: IntArray
    joint: IntArray
    side: IntArray
    normal: Array
    scaled_normal: Array
    orthonormal_basis: Array
    cholesky_factor: Array
    target: Array
    multiplier: Array
    violation: Array
    change: Array


@inline_kernel
def scale(cost: Quadratic, normal: Array, scaled_normal: Array) -> None:
    """Computes F⁻¹ a, a'/√ρ from the coefficients of a row, (D,). Both arguments may be the same array."""
    for c in range(cost.d):
        scaled_normal[c] = normal[c]
    forward(cost.F, scaled_normal, cost.d)
    for c in range(cost.d, cost.D):
        scaled_normal[c] = cost.share * normal[c]


@inline_kernel
def resolve(active: ActiveSet, index: int, D: int, budget: Array) -> float:
    """Splits row `index` into a combination of the rows before it and a new direction. Writes the
    coefficients to `cholesky_factor` and the direction, not yet of length one, to `orthonormal_basis`.
    Returns the length of the new direction, 0 if the row is linearly dependent on the rows before it."""
    budget[0] -= 4.0 * D * (index + 1.0)
    scaled_normal = active.scaled_normal[index]
    left = split(
        scaled_normal,
        active.orthonormal_basis,
        index,
        D,
        active.cholesky_factor[index],
        active.orthonormal_basis[index],
    )
    length, whole = math.sqrt(left), math.sqrt(dot(scaled_normal, scaled_normal, D))
    # D rows span the whole space. The rounding error of one more row must not count as a new direction.
    return length if index < D and length > _DEPENDENT * whole and length > 1e-14 else 0.0


@inline_kernel
def add_row(active: ActiveSet, index: int, length: float, D: int) -> None:
    """Adds the direction that `resolve` found for row `index` to the orthonormal basis."""
    active.cholesky_factor[index, index] = length
    for c in range(D):
        active.orthonormal_basis[index, c] /= length


@inline_kernel
def move_row(active: ActiveSet, source: int, to: int, D: int) -> None:
    """Copies a row to another index."""
    active.row[to], active.joint[to], active.side[to] = (
        active.row[source],
        active.joint[source],
        active.side[source],
    )
    active.target[to], active.multiplier[to] = active.target[source], active.multiplier[source]
    copy(active.normal[source], active.normal[to], D)
    copy(active.scaled_normal[source], active.scaled_normal[to], D)


@inline_kernel
def remove_row(active: ActiveSet, index: int, k: int, D: int, budget: Array) -> None:
    """Removes row `index` of k. The rows behind it move up, and rotations make `cholesky_factor` triangular
    again."""
    budget[0] -= 6.0 * D * (k - index)
    for p in range(index, k - 1):
        move_row(active, p + 1, p, D)
    close_gap(active.cholesky_factor, active.orthonormal_basis, index, k, D)


@inline_kernel
def update_multipliers(active: ActiveSet, cost: Quadratic, k: int) -> None:
    """Computes the multipliers of k rows that hold as equalities."""
    for p in range(k):
        active.multiplier[p] = dot(active.scaled_normal[p], cost.ideal, cost.d) - active.target[p]
    forward(active.cholesky_factor, active.multiplier, k)
    backward(active.cholesky_factor, active.multiplier, k)


@inline_kernel
def point_from_multipliers(active: ActiveSet, cost: Quadratic, k: int, z: Array) -> None:
    """Computes the point that belongs to the multipliers of k rows, in scaled coordinates, (D,)."""
    for c in range(cost.D):
        z[c] = cost.ideal[c] if c < cost.d else 0.0
    for p in range(k):
        subtract(active.multiplier[p], active.scaled_normal[p], z, cost.D)


@inline_kernel
def unscale(cost: Quadratic, z: Array, x: Array) -> None:
    """Computes a point from its scaled coordinates. Both arguments may be the same array."""
    copy(z, x, cost.D)
    backward(cost.F, x, cost.d)
    for c in range(cost.d, cost.D):
        x[c] *= cost.share


@inline_kernel
def evaluate(active: ActiveSet, x: Array, k: int, D: int, slope: Array) -> tuple[float, float]:
    """Adds the multipliers' part to the gradient of the cost at a point, and writes the violations of k rows.
    It returns the largest violation, and the largest product of a violation and its multiplier."""
    violation = worth = 0.0
    for p in range(k):
        subtract(-active.multiplier[p], active.normal[p], slope, D)
        active.violation[p] = dot(active.normal[p], x, D) - active.target[p]
        violation, worth = (
            max(violation, abs(active.violation[p])),
            max(worth, abs(active.multiplier[p] * active.violation[p])),
        )
    return violation, worth


@inline_kernel
def correct(active: ActiveSet, cost: Quadratic, k: int, slope: Array, z: Array, x: Array) -> None:
    """Performs a step of iterative refinement: corrects a point and the multipliers of k rows by the gradient
    and the violations that `evaluate` has computed.

    z: scratch, (D,).
    """
    d, D, share = cost.d, cost.D, cost.share
    for c in range(D):
        z[c] = -slope[c] if c < d else -share * slope[c]
    forward(cost.F, z, d)
    for p in range(k):
        active.change[p] = dot(active.scaled_normal[p], z, D) + active.violation[p]
    forward(active.cholesky_factor, active.change, k)
    backward(active.cholesky_factor, active.change, k)
    for p in range(k):
        subtract(active.change[p], active.scaled_normal[p], z, D)
        active.multiplier[p] += active.change[p]
    backward(cost.F, z, d)
    for c in range(D):
        x[c] += z[c] if c < d else share * z[c]

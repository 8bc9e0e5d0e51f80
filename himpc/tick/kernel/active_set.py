"""The active rows, which hold as equalities: an orthonormal basis of them, their multipliers, and the point
that they determine. HIMPC's levels and HTMPC's QPs use it."""

from __future__ import annotations

import math
from typing import NamedTuple

from himpc.compilation.compiled import inline_kernel
from himpc.tick.kernel.arrays import Array, Whole
from himpc.tick.kernel.linear import backward, close_gap, copy, dot, forward, split, subtract

_DEPENDENT = 1e-10
"""A row is linearly dependent on the active rows if less than this share of it is orthogonal to them."""


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
    """The active rows a'x ≤ b, k of them, with room for more.

    Attributes:
        row, joint, side: which they are, and whether the upper (1) or the lower bound (−1); 0 is a row that
            stays an equality, whatever its multiplier is.
        normal: their a, in the coordinates of the cost.
        scaled_normal: the same where the Hessian is one: F⁻¹ a, a'/√ρ.
        orthonormal_basis, cholesky_factor: orthonormal rows, and the lower triangle of
            scaled_normal = cholesky_factor · orthonormal_basis.
        target: their b.
        multiplier: their multipliers, positive at an upper bound.
        violation: by how much the point misses them.
        change: scratch.
    """

    row: Whole
    joint: Whole
    side: Whole
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
    """F⁻¹ a, a'/√ρ from the coefficients of a row, (D,); both arrays may be one."""
    for c in range(cost.d):
        scaled_normal[c] = normal[c]
    forward(cost.F, scaled_normal, cost.d)
    for c in range(cost.d, cost.D):
        scaled_normal[c] = cost.share * normal[c]


@inline_kernel
def resolve(active: ActiveSet, index: int, D: int, budget: Array) -> float:
    """Row `index` in terms of those before it: its coefficients go into `cholesky_factor`, the new
    direction into `orthonormal_basis`, not yet of length one. Returns the length of what is new, 0 if the row
    depends on the others."""
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
    # D rows span the whole space: the rounding error of one more row must not count as a new direction.
    return length if index < D and length > _DEPENDENT * whole and length > 1e-14 else 0.0


@inline_kernel
def fix(active: ActiveSet, index: int, length: float, D: int) -> None:
    """Adds the direction that `resolve` found for row `index` to the orthonormal basis."""
    active.cholesky_factor[index, index] = length
    for c in range(D):
        active.orthonormal_basis[index, c] /= length


@inline_kernel
def move(active: ActiveSet, source: int, to: int, D: int) -> None:
    """Copies a row to another place."""
    active.row[to], active.joint[to], active.side[to] = (
        active.row[source],
        active.joint[source],
        active.side[source],
    )
    active.target[to], active.multiplier[to] = active.target[source], active.multiplier[source]
    copy(active.normal[source], active.normal[to], D)
    copy(active.scaled_normal[source], active.scaled_normal[to], D)


@inline_kernel
def without(active: ActiveSet, index: int, k: int, D: int, budget: Array) -> None:
    """Removes row `index` of k. The rows behind it move up, and rotations make `cholesky_factor` triangular
    again."""
    budget[0] -= 6.0 * D * (k - index)
    for p in range(index, k - 1):
        move(active, p + 1, p, D)
    close_gap(active.cholesky_factor, active.orthonormal_basis, index, k, D)


@inline_kernel
def update_multipliers(active: ActiveSet, cost: Quadratic, k: int) -> None:
    """Multipliers of k rows as equalities."""
    for p in range(k):
        active.multiplier[p] = dot(active.scaled_normal[p], cost.ideal, cost.d) - active.target[p]
    forward(active.cholesky_factor, active.multiplier, k)
    backward(active.cholesky_factor, active.multiplier, k)


@inline_kernel
def point_from_multipliers(active: ActiveSet, cost: Quadratic, k: int, z: Array) -> None:
    """The point that belongs to the multipliers of k rows, in scaled coordinates, (D,)."""
    for c in range(cost.D):
        z[c] = cost.ideal[c] if c < cost.d else 0.0
    for p in range(k):
        subtract(active.multiplier[p], active.scaled_normal[p], z, cost.D)


@inline_kernel
def unscale(cost: Quadratic, z: Array, x: Array) -> None:
    """A point from its scaled coordinates; both arrays may be one."""
    copy(z, x, cost.D)
    backward(cost.F, x, cost.d)
    for c in range(cost.d, cost.D):
        x[c] *= cost.share


@inline_kernel
def evaluate(active: ActiveSet, x: Array, k: int, D: int, slope: Array) -> tuple[float, float]:
    """Adds the multipliers' part to the gradient of the cost at a point, and writes the violations of k rows.
    Returns the largest violation, and the largest product of a violation and its multiplier."""
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
    """Corrects a point, and the multipliers of k rows, by what `evaluate` found at it: iterative refinement.

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

"""The type of a constraint, and the data on which its bounds depend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from himpc.limits.limits import Limits, LimitsInForce
from himpc.prediction import JointState
from robots.arrays import Array, Mask


class Near(NamedTuple):
    """The pairs of links, or of a link and an object, that could reach d_safe first; the nearest pair comes
    first.

    Attributes:
        distance: d, (r,) m, negative inside.
        gradient: ∇d, (r, n) m/rad.
        moving: (r,) m/s, the speed at which the object's own motion reduces d.
        share: (r,), the share of d_safe and of the margin that is kept: below 1 for links that are close
            together in the home posture.
        names: the name of each pair.
    """

    distance: Array
    gradient: Array
    moving: Array
    share: Array
    names: tuple[str, ...]


class Moment(NamedTuple):
    """The data on which the bounds of one tick depend.

    Attributes:
        state: measured joint state, (n,) each.
        tau_0: torque applied last, (n,) N·m.
        M_bar: diagonal of M̄, (n,) kg·m².
        limits: which bounds are imposed.
        force: the values of these bounds.
        N: horizon.
        T_s: control period, s.
        near: the nearest pairs, if distances have rows.
    """

    state: JointState
    tau_0: Array
    M_bar: Array
    limits: Limits
    force: LimitsInForce
    N: int
    T_s: float
    near: Near | None = None


class Directions(NamedTuple):
    """The directions D_c in joint space that the rows of a constraint bound.

    Attributes:
        D: (n, n), one direction of length one per row. Rows of zeros are unused and have no bounds.
        names: (n,), the name of each direction.
    """

    D: Array
    names: tuple[str, ...]


class Block(NamedTuple):
    """The bounds of a constraint at one tick: lower ≤ L U Dᵀ ≤ upper, U = (N, n) increments.

    Attributes:
        lower, upper: (N, n) N·m, one column per direction, ±inf where there is no bound.
        directions: None if direction c is joint c.
        stopping: see `Rows`.
    """

    lower: Array
    upper: Array
    directions: Directions | None = None
    stopping: Mask | None = None


@dataclass(frozen=True, eq=False)
class Constraint:
    """A constraint on the increments: a time profile L times directions D in joint space, between two bounds.

    Attributes:
        label: name of the constraint where it is shown as active.
        profile: L for a horizon N, (N, N), lower triangular Toeplitz. Row j contains the weights with which
            the increments of the knots add up to the bounded value.
        first_knot: knot whose value the first row bounds: 0 for torques, which act at once, 1 for quantities
            that follow later.
        hard: whether the constraint is always satisfied. All others give way if they cannot be satisfied.
        is_on: whether settings impose the constraint.
        bounds: computes the bounds of the constraint at one tick.
        yields_first: whether the constraint gives way before the others that are not hard.
    """

    label: str
    profile: Callable[[int], Array]
    first_knot: int
    hard: bool
    is_on: Callable[[Limits], bool]
    bounds: Callable[[Moment], Block]
    yields_first: bool = False


def lags(N: int) -> Array:
    """Returns the number of knots j − s between increment s and row j, (N, N)."""
    return np.subtract.outer(np.arange(N), np.arange(N)).astype(float)

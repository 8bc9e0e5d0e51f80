"""The type of a constraint, and the data on which its bounds depend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.limits.limits import Limits, LimitsInForce
from himpc.prediction.joint import JointState

if TYPE_CHECKING:
    from himpc.limits.distance import Near

Array = NDArray[np.float64]


class Moment(NamedTuple):
    """The data on which the bounds of one tick depend.

    Attributes:
        state: measured joint state, (n,) each.
        tau_0: torque applied last, (n,) N·m.
        M_bar: diagonal of M̄, (n,) kg·m².
        limits: which bounds are imposed.
        force: their values.
        N: horizon.
        T_s: control period, s.
        near: the nearest pairs, if distances are kept.
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
        D: (n, n), one direction of length one per row; rows of zeros are not used, and are never bounded.
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
    stopping: NDArray[np.bool_] | None = None


@dataclass(frozen=True, eq=False)
class Constraint:
    """A constraint on the increments: a time profile L times directions D in joint space, between two bounds.

    Attributes:
        label: what it is called where it binds.
        profile: L for a horizon N, (N, N), lower triangular Toeplitz: row j says how the increments of the
            knots add up to what is bounded there.
        first_knot: knot whose value the first row bounds: 0 for what acts at once, 1 for its consequences.
        hard: whether it holds always. The others give way where they cannot be met.
        is_on: whether settings impose it.
        bounds: its bounds at a moment.
        yields_first: whether it gives way before the others that are not hard.
    """

    label: str
    profile: Callable[[int], Array]
    first_knot: int
    hard: bool
    is_on: Callable[[Limits], bool]
    bounds: Callable[[Moment], Block]
    yields_first: bool = False


def lags(N: int) -> Array:
    """Number of knots between increment s and row j, j − s, (N, N)."""
    return np.subtract.outer(np.arange(N), np.arange(N)).astype(float)

"""The bounds of all constraints over the horizon as rows on the increments."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from himpc.limits.constraint import Constraint, Directions, Moment, Near
from himpc.limits.constraints import bit_of, imposed
from himpc.limits.limits import Limits, LimitsInForce
from himpc.limits.position import POSITION
from himpc.limits.velocity import VELOCITY
from himpc.prediction import JointState
from robots.arrays import Array, Indices, Mask


class Rows(NamedTuple):
    """The rows lower ≤ L U Dᵀ ≤ upper with U = (N, n) increments. Each constraint has N rows, and each row
    has n columns, one per direction of the constraint.

    All rows are in N·m: a velocity row is scaled by M̄/T_s, a position row by M̄/T_s², so that one tolerance
    fits all.

    Attributes:
        L: (r, N) lower-triangular Toeplitz blocks, the time profiles of the constraints.
        lower, upper: (r, n), ±inf where there is no bound.
        constraints: the constraint of each block of N rows.
        stopping: (2, n), whether the lower, upper velocity bound of a joint belongs to its position limit.
            Such a bound is the velocity from which the joint can still stop, and is below the joint's
            velocity limit. None if no row has such a bound.
        rest: (N, n) N·m, the values of the velocity rows when the joints come to rest, see `coming_to_rest`.
            None means zeros: the velocities stay constant.
        directions: the directions of each block; None for a block whose column c is joint c. Empty if this
            applies to all blocks.
    """

    L: Array
    lower: Array
    upper: Array
    constraints: tuple[Constraint, ...]
    stopping: Mask | None = None
    rest: Array | None = None
    directions: tuple[Directions | None, ...] = ()

    def values(self, U: Array) -> Array:
        """Returns the bounded values L U Dᵀ, (r, n) N·m."""
        return self._turned(self.L @ U, absolute=False)

    def sizes(self, U: Array) -> Array:
        """Returns the sums of the magnitudes of the terms of `values`, (r, n) N·m. The rounding error of
        `values` is proportional to these sums."""
        return self._turned(self.L @ np.abs(U), absolute=True)

    def _turned(self, value: Array, absolute: bool) -> Array:
        N = self.L.shape[1]
        for index, directions in enumerate(self.directions):
            if directions is not None:
                block = slice(index * N, (index + 1) * N)
                D = np.abs(directions.D) if absolute else directions.D
                value[block] = value[block] @ D.T
        return value

    @property
    def matrix(self) -> Array:
        """The matrix A (r·n, N·n) for which A U, with U ordered by knot and then by joint, are the values of
        the rows."""
        N, n = self.L.shape[1], self.lower.shape[1]
        A = np.kron(self.L, np.eye(n))
        for index, directions in enumerate(self.directions):
            if directions is not None:
                block = slice(index * N, (index + 1) * N)
                A[block.start * n : block.stop * n] = np.kron(self.L[block], directions.D)
        return np.asarray(A, np.float64)

    @property
    def bits(self) -> Indices:
        """The bit of each row in `at_bound`, (r,)."""
        return np.repeat([bit_of(constraint) for constraint in self.constraints], self.L.shape[1])

    @property
    def is_hard(self) -> Mask:
        """Whether each row is hard, (r,): hard rows never give way."""
        return np.repeat([constraint.hard for constraint in self.constraints], self.L.shape[1])

    def directions_of(self, row: int) -> Directions | None:
        """Returns the directions of a row's columns; None if the columns are the joints."""
        return self.directions[row // self.L.shape[1]] if self.directions else None

    def joints_of(self, row: int, column: int) -> tuple[int, ...]:
        """Returns the joints that a row bounds, counted from 0."""
        directions = self.directions_of(row)
        return (column,) if directions is None else tuple(np.flatnonzero(directions.D[column]).tolist())

    def constraint(self, row: int, column: int, upper: bool) -> Constraint:
        """Returns the constraint that a row's upper or lower bound imposes."""
        constraint = self.constraints[row // self.L.shape[1]]
        stops = constraint is VELOCITY and self.stopping is not None and self.stopping[int(upper), column]
        return POSITION if stops else constraint

    def knot(self, row: int) -> int:
        """Returns the knot whose value a row bounds: 1 … N, for torque 0 … N−1."""
        N = self.L.shape[1]
        return row % N + self.constraints[row // N].first_knot

    def widened(self, slack: Array) -> Rows:
        """Returns the rows with both bounds moved outward by `slack`, (r, n) ≥ 0."""
        return self._replace(lower=self.lower - slack, upper=self.upper + slack)


BRAKING = 20.0
"""Decay rate of the velocity of a braking joint, 1/s. The joint is almost at rest after a quarter of a
second."""


@lru_cache(maxsize=64)
def profiles(N: int, constraints: tuple[Constraint, ...]) -> Array:
    """L of `Rows`."""
    return np.vstack([constraint.profile(N) for constraint in constraints])


def build_rows(
    state: JointState,
    tau_0: Array,
    M_bar: Array,
    limits: Limits,
    force: LimitsInForce,
    N: int,
    T_s: float,
    near: Near | None = None,
) -> Rows:
    """Returns the bounds of all constraints that `limits` impose, at every knot.

    With `limits.position == "viability"`, the position limit is a bound in the velocity rows, computed from
    the measured q_k for all knots. With "paper", the position rows are those of (32d): at knot 1 no Δτ can
    influence them, and they do not take into account the distance that a stop needs.

    Args:
        state, tau_0, M_bar, limits, force, N, T_s, near: see `Moment`.
    """
    now = Moment(state, tau_0, M_bar, limits, force, N, T_s, near)
    constraints = imposed(limits)
    blocks = [constraint.bounds(now) for constraint in constraints]
    directions = tuple(block.directions for block in blocks)
    return Rows(
        L=profiles(N, constraints),
        lower=np.concatenate([block.lower for block in blocks]),
        upper=np.concatenate([block.upper for block in blocks]),
        constraints=constraints,
        stopping=next((block.stopping for block in blocks if block.stopping is not None), None),
        rest=coming_to_rest(state, M_bar, N, T_s),
        directions=directions if any(direction is not None for direction in directions) else (),
    )


def coming_to_rest(state: JointState, M_bar: Array, N: int, T_s: float) -> Array:
    """Returns the values of the velocity rows, (N, n) N·m, for velocities that decay as e^{−BRAKING t}. The
    arguments are those of `build_rows`."""
    t = T_s * np.arange(1.0, N + 1)[:, None]
    return (np.expm1(-BRAKING * t) * state.v - state.gained_velocity(N, T_s)) * (M_bar / T_s)

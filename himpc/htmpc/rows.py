"""The linear rows of (7d): velocity, position, input and jerk bounds on the condensed inputs.

All rows have the form lower ≤ A u ≤ upper with u the inputs, knot by knot, (N·n,). Two groups of rows concern
the time beyond the horizon, so that the next step's problem is feasible too. With the "ramp" rows, the input
can return to zero within the jerk bound. With the "stop" rows, a joint can stop before a position bound.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from himpc.htmpc.kernel.kinds import ACCELERATION
from himpc.htmpc.kernel.rows import RAMP_STEPS, STOP_STEPS, about, limits, spread
from himpc.htmpc.prediction import Start, integrator
from himpc.htmpc.settings import MotionBounds
from robots.arrays import Array, Integers, Mask


class ConstraintRows(NamedTuple):
    """Constraint rows with labels.

    Attributes:
        A: (r, N·n); lower, upper: (r,).
        kind: (r,) index into KINDS; knot: (r,) 1 … N (0 … N−1 for inputs); part: (r,) index of the joint, of
            the coordinate or of the pair.
    """

    A: Array
    lower: Array
    upper: Array
    kind: Integers
    knot: Integers
    part: Integers

    def take(self, chosen: Mask) -> ConstraintRows:
        """Returns the chosen rows."""
        A, lower, upper, kind, knot, part = self
        return ConstraintRows(
            A[chosen], lower[chosen], upper[chosen], kind[chosen], knot[chosen], part[chosen]
        )

    def widened(self, u: Array, last: int = 0) -> ConstraintRows:
        """Returns the rows with bounds widened just enough to contain u. The last `last` rows are not
        widened."""
        value = self.A @ u
        lower, upper = np.minimum(self.lower, value), np.maximum(self.upper, value)
        end = len(value) - last
        lower[end:], upper[end:] = self.lower[end:], self.upper[end:]
        return self._replace(lower=lower, upper=upper)


class ConstraintTable:
    """Storage for all rows of a controller. Every step fills it again: first the rows of (7d), then the rows
    of a QP.

    Attributes:
        A: rows on the inputs u, or on their change d.
        bounds: (2, …), lower and upper on Au, for the rows of (7d).
        room: (2, …), lower and upper on Ad.
        labels: (3, …), kind, knot and part.
    """

    def __init__(self, columns: int) -> None:
        """columns: N·n."""
        self.A = np.zeros((0, columns))
        self.bounds, self.room = np.zeros((2, 0)), np.zeros((2, 0))
        self.labels = np.zeros((3, 0), np.int64)

    def reserve(self, count: int) -> None:
        """Allocates space for `count` rows in all; existing rows are kept."""
        missing = count - len(self.A)
        if missing > 0:
            self.A = np.vstack([self.A, np.zeros((missing + 100, self.A.shape[1]))])
            self.bounds, self.room, self.labels = (
                np.hstack([array, np.zeros((len(array), missing + 100), array.dtype)])
                for array in (self.bounds, self.room, self.labels)
            )

    def absolute(self, count: int) -> ConstraintRows:
        """Returns the first `count` rows, as rows on u, in views of the table."""
        return ConstraintRows(self.A[:count], *self.bounds[:, :count], *self.labels[:, :count])

    def changes(self, first: int, end: int) -> ConstraintRows:
        """Returns the rows on d from index `first` to index `end`. They are views of the table; only the
        labels are copied."""
        return ConstraintRows(self.A[first:end], *self.room[:, first:end], *self.labels[:, first:end].copy())

    def about(self, u: Array, count: int) -> None:
        """Sets the bounds on Ad of the first `count` rows: the bounds on Au, minus Au."""
        about(self.A, self.bounds, u, count, self.room)

    def outside(self, count: int) -> float:
        """Returns the largest violation of the bounds of the first `count` rows by u, the argument of the
        last call of `about`."""
        lower, upper = self.room[:, :count]
        return max(0.0, float(lower.max(initial=0.0)), -float(upper.min(initial=0.0)))

    def put(self, row: int, rows: ConstraintRows) -> int:
        """Writes bounds and labels of rows on d to the table, which already contains their A. Returns the
        index after the rows."""
        end = row + len(rows.A)
        self.room[:, row:end] = rows.lower, rows.upper
        self.labels[:, row:end] = rows.kind, rows.knot, rows.part
        return end

    def spread(self, row: int, knot: Integers, slopes: Array, T_q: Array) -> Array:
        """Writes rows of functions of q, from index `row` on, and returns them. `slopes` (r, n) are the
        derivatives of the functions with respect to q at the knots (r,)."""
        self.reserve(row + len(knot))
        spread(self.A, row, np.asarray(knot, np.intp), np.ascontiguousarray(slopes), T_q)
        return self.A[row : row + len(knot)]


def limit_rows(
    start: Start, N: int, dt: float, period: float, bounds: MotionBounds, table: ConstraintTable | None = None
) -> ConstraintRows:
    """Returns the rows of this tick's bounds. They are written to the beginning of a table.

    Only rows that can become active are included: a row is left out if no inputs inside the input bounds
    can reach its bound.
    """
    n = len(start.v)
    table = ConstraintTable(N * n) if table is None else table
    table.reserve((4 * N + RAMP_STEPS + STOP_STEPS) * n)
    matrices = integrator(N, dt)
    count = limits(
        *(matrices.T_v, matrices.T_q, matrices.t, *start),
        *(bounds.q_lower, bounds.q_upper, bounds.v, bounds.a, bounds.j, period, dt),
        *(table.A, table.bounds, table.labels),
    )
    return table.absolute(count)


def held(rows: ConstraintRows, brake: Array, joints: Integers, table: ConstraintTable) -> ConstraintRows:
    """Writes rows that bring some joints to rest with the inputs of `brake` (N, n). They replace the rows of
    these joints in `rows`. All rows are written to the beginning of the table."""
    N, n = brake.shape
    chosen = (np.arange(N)[:, None] * n + joints).ravel()
    value = brake.ravel()[chosen]
    labels = np.full(len(chosen), ACCELERATION), np.repeat(np.arange(N), len(joints)), np.tile(joints, N)
    left = rows.take(~np.isin(rows.part, joints))
    count = len(left.A) + len(chosen)
    table.reserve(count)
    table.A[:count] = np.vstack([left.A, np.eye(N * n)[chosen]])
    table.bounds[:, :count] = np.hstack([left[1:3], [value, value]])
    table.labels[:, :count] = np.hstack([left[3:], labels])
    return table.absolute(count)

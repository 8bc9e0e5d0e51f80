"""The linear rows of (7d): velocity, position, input and jerk bounds on the condensed inputs.

All rows read lower ≤ A u ≤ upper with u the inputs, knot by knot, (N·n,). Two groups see past the horizon, so
that the next step's problem has a solution too: "ramp" rows leave room to take the input back to zero within
the jerk bound, "stop" rows room to stop before a position bound.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.kernel.rows import RAMP_STEPS, STOP_STEPS, limits, spread
from himpc.htmpc.prediction import Start, integrator
from himpc.htmpc.settings import Bounds

Array = NDArray[np.float64]
KINDS = ("velocity", "position", "acceleration", "jerk", "ramp", "stop", "lexicographic", "collision")


class Rows(NamedTuple):
    """Rows with labels.

    Attributes:
        A: (r, N·n); lower, upper: (r,).
        kind: (r,) index into KINDS; knot: (r,) 1 … N (0 … N−1 for inputs); part: (r,) joint or coordinate.
    """

    A: Array
    lower: Array
    upper: Array
    kind: NDArray[np.int64]
    knot: NDArray[np.int64]
    part: NDArray[np.int64]

    def take(self, chosen: NDArray[np.bool_]) -> Rows:
        """The chosen rows."""
        A, lower, upper, kind, knot, part = self
        return Rows(A[chosen], lower[chosen], upper[chosen], kind[chosen], knot[chosen], part[chosen])

    def about(self, u: Array) -> Rows:
        """The same rows for the change d of u, u + d."""
        value = self.A @ u
        return self._replace(lower=self.lower - value, upper=self.upper - value)

    def widened(self, u: Array) -> Rows:
        """Bounds moved out just far enough to contain u."""
        value = self.A @ u
        return self._replace(lower=np.minimum(self.lower, value), upper=np.maximum(self.upper, value))

    def violation(self, u: Array) -> float:
        """By how much u leaves the bounds, largest row."""
        value = self.A @ u
        excess = np.maximum(self.lower - value, value - self.upper)
        return max(0.0, float(excess.max(initial=0.0)))


def joined(*parts: Rows) -> Rows:
    """All rows of several groups."""
    return Rows(
        np.concatenate([rows.A for rows in parts]),
        np.concatenate([rows.lower for rows in parts]),
        np.concatenate([rows.upper for rows in parts]),
        np.concatenate([rows.kind for rows in parts]),
        np.concatenate([rows.knot for rows in parts]),
        np.concatenate([rows.part for rows in parts]),
    )


class Table:
    """Room for all rows of a controller: one array, filled anew at every step. Rows are views of it."""

    def __init__(self, columns: int) -> None:
        """columns: N·n."""
        self.A = np.zeros((0, columns))
        self.bounds = np.zeros((2, 0))
        self.labels = np.zeros((3, 0), np.int64)

    def reserve(self, count: int) -> None:
        """Room for that many rows; those that are there stay."""
        missing = count - len(self.A)
        if missing > 0:
            self.A = np.vstack([self.A, np.zeros((missing + 100, self.A.shape[1]))])
            self.bounds = np.hstack([self.bounds, np.zeros((2, missing + 100))])
            self.labels = np.hstack([self.labels, np.zeros((3, missing + 100), np.int64)])

    def spread(self, place: int, knot: NDArray[np.int64], slopes: Array, T_q: Array) -> Array:
        """From a place on, the rows whose values at knots (r,) have slopes (r, n) in q; returns them."""
        self.reserve(place + len(knot))
        spread(self.A, place, np.asarray(knot, np.intp), np.ascontiguousarray(slopes), T_q)
        return self.A[place : place + len(knot)]


def limit_rows(
    start: Start, N: int, dt: float, period: float, bounds: Bounds, table: Table | None = None
) -> Rows:
    """All rows that bounds of this tick can make binding, in a table, from its beginning on.

    A row is left out when no inputs inside the input bounds can reach its bound.
    """
    n = len(start.v)
    table = Table(N * n) if table is None else table
    table.reserve((4 * N + RAMP_STEPS + STOP_STEPS) * n)
    matrices = integrator(N, dt)
    q, v, u = (np.array(each, float) for each in start)
    every = (bounds.q_lower, bounds.q_upper, bounds.v, bounds.a, bounds.j)
    in_force = (np.array(each, float) for each in every)
    count = limits(
        *(matrices.T_v, matrices.T_q, matrices.t, q, v, u, *in_force, period, dt),
        *(table.A, table.bounds, table.labels),
    )
    return Rows(table.A[:count], *table.bounds[:, :count], *table.labels[:, :count])


def held(rows: Rows, brake: Array, joints: NDArray[np.int64], table: Table) -> Rows:
    """Rows that keep some joints on their way to rest: their inputs are those of `brake` (N, n). They take
    the place of the given ones at the beginning of the table."""
    N, n = brake.shape
    chosen = (np.arange(N)[:, None] * n + joints).ravel()
    value = brake.ravel()[chosen]
    fixed = Rows(
        np.eye(N * n)[chosen],
        value,
        value,
        np.full(len(chosen), 2),
        np.repeat(np.arange(N), len(joints)),
        np.tile(joints, N),
    )
    found = joined(rows.take(~np.isin(rows.part, joints)), fixed)
    table.reserve(len(found.A))
    table.A[: len(found.A)] = found.A
    return found._replace(A=table.A[: len(found.A)])

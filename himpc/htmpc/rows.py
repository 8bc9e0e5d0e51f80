"""The linear rows of (7d): velocity, position, input and jerk bounds on the condensed inputs.

All rows read lower ≤ A u ≤ upper with u the inputs, knot by knot, (N·n,). Two groups see past the horizon, so
that the next step's problem has a solution too: "ramp" rows leave room to take the input back to zero within
the jerk bound, "stop" rows room to stop before a position bound.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.compiled import (
    FIXED,
    FIXED_VECTOR,
    INDICES,
    MATRIX,
    NUMBER,
    TABLE,
    VECTOR,
    WHOLE,
    compiled,
)
from himpc.htmpc.prediction import Start, integrator
from himpc.htmpc.settings import Bounds

Array = NDArray[np.float64]
KINDS = ("velocity", "position", "acceleration", "jerk", "ramp", "stop", "lexicographic", "collision")

_RAMP_STEPS = 10
"""The input is taken back within at most this many knots beyond the horizon."""
_STOP_STEPS = 40
"""Braking is watched for at most this many knots beyond the horizon."""


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
        _spread(self.A, place, np.asarray(knot, np.intp), np.ascontiguousarray(slopes), T_q)
        return self.A[place : place + len(knot)]


@compiled(MATRIX, WHOLE, INDICES, MATRIX, FIXED)
def _spread(A: Array, place: int, knot: NDArray[np.intp], slopes: Array, T_q: Array) -> None:
    n = slopes.shape[1]
    for r in range(len(knot)):
        for s in range(len(T_q)):
            for j in range(n):
                A[place + r, s * n + j] = T_q[knot[r], s] * slopes[r, j]


def limit_rows(
    start: Start, N: int, dt: float, period: float, bounds: Bounds, table: Table | None = None
) -> Rows:
    """All rows that bounds of this tick can make binding, in a table, from its beginning on.

    A row is left out when no inputs inside the input bounds can reach its bound.
    """
    n = len(start.v)
    table = Table(N * n) if table is None else table
    table.reserve((4 * N + _RAMP_STEPS + _STOP_STEPS) * n)
    matrices = integrator(N, dt)
    q, v, u = (np.array(each, float) for each in start)
    every = (bounds.q_lower, bounds.q_upper, bounds.v, bounds.a, bounds.j)
    limits = (np.array(each, float) for each in every)
    count = _limits(
        *(matrices.T_v, matrices.T_q, matrices.t, q, v, u, *limits, period, dt),
        *(table.A, table.bounds, table.labels),
    )
    return Rows(table.A[:count], *table.bounds[:, :count], *table.labels[:, :count])


@compiled(
    *(FIXED, FIXED, FIXED_VECTOR, VECTOR, VECTOR, VECTOR),
    *(VECTOR, VECTOR, VECTOR, VECTOR, VECTOR, NUMBER, NUMBER),
    *(MATRIX, MATRIX, TABLE),
)
def _limits(
    T_v: Array,
    T_q: Array,
    t: Array,
    q: Array,
    v: Array,
    u: Array,
    q_lower: Array,
    q_upper: Array,
    v_max: Array,
    a_max: Array,
    j_max: Array,
    period: float,
    dt: float,
    A: Array,
    bounds: Array,
    labels: NDArray[np.int64],
) -> int:
    N, n = len(t), len(q)
    T, count = t[N - 1], 0
    for kind in range(4):
        for k in range(N):
            for i in range(n):
                a = a_max[i]
                if kind == 0:
                    middle, low, high, reach = v[i], -v_max[i], v_max[i], t[k] * a
                elif kind == 1:
                    middle, low, high = q[i] + t[k] * v[i], q_lower[i], q_upper[i]
                    reach = 0.5 * t[k] ** 2 * a
                elif kind == 2:
                    middle, low, high, reach = 0.0, -a, a, np.inf
                else:
                    change = j_max[i] * (min(period, dt) if k == 0 else dt)
                    middle, low, high = -u[i] if k == 0 else 0.0, -change, change
                    reach = a + abs(u[i]) if k == 0 else 2.0 * a
                low, high = low - middle, high - middle
                if (np.isfinite(low) or np.isfinite(high)) and (high < reach or low > -reach):
                    A[count] = 0.0
                    if kind < 2:
                        for s in range(k + 1):
                            A[count, s * n + i] = T_v[k, s] if kind == 0 else T_q[k, s]
                    else:
                        A[count, k * n + i] = 1.0
                        if kind == 3 and k > 0:
                            A[count, (k - 1) * n + i] = -1.0
                    bounds[0, count], bounds[1, count] = low, high
                    labels[0, count], labels[1, count], labels[2, count] = kind, k + (kind < 2), i
                    count += 1
    # "ramp": |v_N ± Δt (m u_{N−1} − j Δt m(m+1)/2)| ≤ v_max, speed while the input goes back to zero.
    for i in range(n):
        step = j_max[i] * dt
        if not (np.isfinite(step) and np.isfinite(v_max[i]) and a_max[i] > step):
            continue
        for m in range(1, int(min(np.ceil(a_max[i] / step), _RAMP_STEPS)) + 1):
            A[count] = 0.0
            for s in range(N):
                A[count, s * n + i] = T_v[N - 1, s]
            A[count, (N - 1) * n + i] += m * dt
            room = v_max[i] + dt * step * m * (m + 1) / 2
            bounds[0, count], bounds[1, count] = -room - v[i], room - v[i]
            labels[0, count], labels[1, count], labels[2, count] = 4, N, i
            count += 1
    # "stop": q_N + mΔt v_N ∓ ½a(mΔt)² inside the range, where full braking for m steps leads; left out where
    # the fastest motion that the input bounds permit does not get there.
    for m in range(1, _STOP_STEPS + 1):
        ahead = m * dt
        for i in range(n):
            a = a_max[i]
            if not (np.isfinite(a) and (np.isfinite(q_lower[i]) or np.isfinite(q_upper[i]))):
                continue
            fastest = min(v_max[i], abs(v[i]) + a * T)
            if not ahead < fastest / a + dt:
                continue
            end, brake = q[i] + T * v[i], 0.5 * a * ahead**2
            far = 0.5 * a * T**2 + ahead * fastest - brake
            if not (end + far > q_upper[i] or end - far < q_lower[i]):
                continue
            A[count] = 0.0
            for s in range(N):
                A[count, s * n + i] = T_q[N - 1, s] + ahead * T_v[N - 1, s]
            coasting = end + ahead * v[i]
            bounds[0, count] = q_lower[i] - brake - coasting
            bounds[1, count] = q_upper[i] + brake - coasting
            labels[0, count], labels[1, count], labels[2, count] = 5, N, i
            count += 1
    return count


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

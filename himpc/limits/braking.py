"""Computes, joint by joint, increments that bring the joints to rest and satisfy all bounds whenever this is
possible."""

from __future__ import annotations

from operator import is_

import numpy as np
from numpy.typing import NDArray

from himpc.limits.apart import kept_apart
from himpc.limits.position import POSITION
from himpc.limits.rows import Rows
from himpc.limits.sequences import clamped, steps, viable
from himpc.limits.torque import TORQUE
from himpc.limits.velocity import VELOCITY
from himpc.limits.yielding import MET, closest_to_rest
from himpc.qp import solve_qp

Array = NDArray[np.float64]

_ITERATIONS = 300
"""Largest number of iterations of the QP of one joint."""


def braking(rows: Rows) -> Array:
    """Returns increments (N, n), N·m, that always satisfy the torque rows. Whenever this is possible, they
    also satisfy all other rows, except those that yield first.

    Rows of torque, velocity and position do not couple joints. Let τ_i be the torque gained up to knot i, and
    w_j = Σ_{i≤j} τ_i. Torque rows bound w_j − w_{j−1}, and velocity rows bound w_j. A backward pass from the
    last knot computes the interval of w_j from which all later rows can still be satisfied. A forward pass
    chooses each w_j as close to `rows.rest` as these intervals allow. If no w_j satisfies all bounds, the
    velocity row of an earlier knot has priority over those of later knots. Position rows bound sums of w_j.
    With position rows, the sequence closest to `rows.rest` is the solution of a QP with N unknowns for each
    joint. Rows that yield first are handled after all these rows: they are satisfied if one step of torque
    suffices, see `kept_apart`. If there are rows of other constraints, see `closest_to_rest`.
    """
    N, n = rows.L.shape[1], rows.lower.shape[1]
    rest = np.zeros((N, n)) if rows.rest is None else rows.rest
    own = _own(rows)
    if own < len(rows.constraints):
        if not all(constraint.yields_first for constraint in rows.constraints[own:]):
            return closest_to_rest(rows, rest)
        return kept_apart(rows, own * N, braking(_first(rows, own)))
    w = _walk(rows, rest)
    U = steps(steps(w))
    if len(rows.constraints) == 3:
        for joint in np.flatnonzero(missed(rows, U).max(axis=0) > MET).tolist():
            closest = _closest(rows, joint, rest[:, joint])
            if closest is not None:
                w[:, joint] = closest
        U = steps(steps(w))
    return U


def _own(rows: Rows) -> int:
    """Returns the number of constraints, from the first on, whose rows do not couple joints and can be
    handled here."""
    known = list(map(is_, rows.constraints, (TORQUE, VELOCITY, POSITION)))
    return next((index for index, is_own in enumerate(known) if not is_own), len(known))


def _first(rows: Rows, count: int) -> Rows:
    """Returns the rows of the first `count` constraints."""
    end = count * rows.L.shape[1]
    return rows._replace(
        L=rows.L[:end],
        lower=rows.lower[:end],
        upper=rows.upper[:end],
        constraints=rows.constraints[:count],
        directions=(),
    )


def missed(rows: Rows, U: Array) -> Array:
    """Returns by how much increments (N, n) violate rows, (r, n) ≥ 0 N·m. Rounding errors of the sums count
    as 0."""
    value, summed = rows.values(U), rows.sizes(U)
    excess = np.maximum(np.maximum(value - rows.upper, rows.lower - value), 0.0)
    excess[excess <= 1e-14 * len(rows.L) * summed] = 0.0
    return excess


def least_slack(rows: Rows) -> Array:
    """Returns the least slack of the rows of velocity and position so that some increments satisfy all rows;
    zero if the rows are feasible.

    Returns:
        slack, (r, n) ≥ 0 N·m (in the rows' scaling), zero on torque rows.
    """
    slack = missed(rows, braking(rows))
    slack[: rows.L.shape[1]] = 0.0
    if len(rows.constraints) >= 3 or _own(rows) < 2:
        slack[slack <= MET] = 0.0
    return slack


def _walk(rows: Rows, rest: Array) -> Array:
    """Returns w, (N, n), that satisfies the torque and velocity rows. At each knot, only the next position
    row is used."""
    N = len(rest)
    least, most = rows.lower[:N], rows.upper[:N]
    low, high = viable(rows.lower[N : 2 * N], rows.upper[N : 2 * N], least, most)
    w, before, position = np.empty_like(rest), np.zeros(rest.shape[1]), np.zeros(rest.shape[1])
    for j in range(N):
        wanted = clamped(rest[j], low[j], high[j])
        if len(rows.constraints) == 3 and j + 1 < N:
            row = 2 * N + j + 1
            wanted = clamped(wanted, rows.lower[row] - position, rows.upper[row] - position)
        before = w[j] = clamped(wanted, before + least[j], before + most[j])
        position = position + before
    return w


def _closest(rows: Rows, joint: int, rest: Array) -> Array | None:
    """Returns w of one joint that satisfies all rows and is closest to `rest`, (N,); None if the rows are
    infeasible."""
    N = rest.size
    sums = np.tril(np.ones((N, N)))
    A = np.vstack([np.eye(N) - np.eye(N, k=-1), np.eye(N), sums[: N - 1]])
    # No increment moves the first position row.
    kept = np.r_[0 : 2 * N, 2 * N + 1 : 3 * N]
    lower, upper = rows.lower[kept, joint], rows.upper[kept, joint]
    solution = solve_qp(np.eye(N), -rest, A, lower, upper, "daqp", _ITERATIONS)
    value = A @ solution.x
    met = bool(((value <= upper + MET) & (value >= lower - MET)).all())
    if not met:
        return None
    # Small violations of the torque rows by the solver are removed: these rows are satisfied exactly.
    w, before = np.empty(N), 0.0
    for j in range(N):
        before = w[j] = min(max(solution.x[j], before + rows.lower[j, joint]), before + rows.upper[j, joint])
    return w

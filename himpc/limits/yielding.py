"""Computes increments for rows of any constraints, including rows that couple joints. The increments satisfy
all rows if the rows are feasible. Otherwise they satisfy the hard rows, and the other rows give way by least
squares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.limits.constraint import Constraint
from himpc.limits.rows import Rows
from himpc.limits.sequences import clamped, steps, viable
from himpc.limits.torque import TORQUE
from himpc.limits.torque_rate import TORQUE_RATE
from himpc.limits.velocity import summed_twice
from himpc.qp import solve_qp

Array = NDArray[np.float64]

MET = 1e-7
"""A row whose violation is smaller than this, N·m, counts as satisfied."""
_ITERATIONS = 300
"""Largest number of iterations of one QP."""
_WORK = 40_000
"""Largest product of unknowns and rows, over all QPs. If it is exceeded, the torque changes at fewer
knots."""
_ROWS = 1000
"""Largest number of rows of a group of coupled joints. If the group has more rows, its joints brake with
bounds on torque and torque rate only."""
_FAINT = 1e-5
"""Weight of the unknowns in the QP that determines by how much rows give way."""


class _Part(NamedTuple):
    """The rows lower ≤ A x ≤ upper of some joints, whose increments (N, c) are T x.

    Attributes:
        A: (k, p·c).
        lower, upper: (k,) N·m.
        T: (N, p).
        G: (N, p); the values of velocity rows are G x.
        ranks: (k,) 0 for torque rows, 1 for other hard rows, 2 for soft rows, 3 for rows that give way first.
    """

    A: Array
    lower: Array
    upper: Array
    T: Array
    G: Array
    ranks: NDArray[np.intp]


def closest_to_rest(rows: Rows, rest: Array) -> Array:
    """Returns increments (N, n), N·m, that satisfy all rows. Among such increments, the values of their
    velocity rows are closest to `rest`, (N, n).

    Joints that share a direction are a group; each group is a strictly convex QP. If no increments satisfy
    all rows, the rows that yield first give way by least squares. If no increments satisfy the remaining
    rows, all rows that are not hard give way too. If even the hard rows cannot be satisfied, only the torque
    rows do not give way. If the QPs are larger than _WORK, the torque changes only at some evenly spaced
    knots, including the first. A group with more rows than _ROWS gets no QP. In all cases, the rows of torque
    and of torque rate are satisfied if any increments satisfy them, see `_within`.
    """
    U = steps(steps(rest))
    for group in groups(rows, rest.shape[1]):
        part = _part(rows, group)
        if len(part.A) > _ROWS:
            continue
        x = _closest(part, rest[:, group])
        if x is None:
            last = int(part.ranks.max())
            for rank in range(1, last + 1):
                if rank == last or _closest(_up_to(part, rank), rest[:, group]) is None:
                    part = _given_way(part, rank)
            x = _closest(part, rest[:, group])
        if x is not None:
            U[:, group] = part.T @ x.reshape(-1, len(group))
    return _within(rows, np.cumsum(U, axis=0))


def groups(rows: Rows, n: int) -> list[list[int]]:
    """Returns groups of joints. Two joints are in one group if a bounded direction couples them."""
    coupled = [{joint} for joint in range(n)]
    N = rows.L.shape[1]
    bounded = np.isfinite(rows.lower) | np.isfinite(rows.upper)
    for index, directions in enumerate(rows.directions):
        if directions is None:
            continue
        used = bounded[index * N : (index + 1) * N].any(axis=0)
        for along in directions.D[used]:
            joints = set(np.flatnonzero(along).tolist())
            apart = [group for group in coupled if not group & joints]
            coupled = [*apart, joints.union(*(group for group in coupled if group & joints))]
    return [sorted(group) for group in coupled]


def _part(rows: Rows, group: list[int]) -> _Part:
    N, c = rows.L.shape[1], len(group)
    moves = max(1, min(N, _WORK // (rows.lower.size * c)))
    if moves == N:
        # The unknowns are the values of the velocity rows.
        T, G = np.eye(N) - 2.0 * np.eye(N, k=-1) + np.eye(N, k=-2), np.eye(N)
    else:
        T = np.eye(N)[:, np.linspace(0, N - 1, moves).astype(int)]
        G = summed_twice(N) @ T
    A, lower, upper, ranks = [], [], [], []
    for index, constraint in enumerate(rows.constraints):
        block = slice(index * N, (index + 1) * N)
        directions = rows.directions[index] if rows.directions else None
        D = np.eye(c) if directions is None else directions.D[:, group]
        columns = group if directions is None else np.flatnonzero(D.any(axis=1))
        own = np.kron(rows.L[block] @ T, D if directions is None else D[columns])
        low, high = rows.lower[block][:, columns].ravel(), rows.upper[block][:, columns].ravel()
        # No increment moves the first position row.
        kept = own.any(axis=1) & (np.isfinite(low) | np.isfinite(high))
        A.append(own[kept])
        lower.append(low[kept])
        upper.append(high[kept])
        ranks.append(np.full(kept.sum(), _rank(constraint)))
    return _Part(np.vstack(A), np.concatenate(lower), np.concatenate(upper), T, G, np.concatenate(ranks))


def _rank(constraint: Constraint) -> int:
    """See `_Part.ranks`."""
    return 0 if constraint is TORQUE else 1 if constraint.hard else 3 if constraint.yields_first else 2


def _closest(part: _Part, rest: Array) -> Array | None:
    """Returns x that satisfies all rows and whose velocity rows are closest to `rest`, (N, c); None if the
    rows are infeasible."""
    c = rest.shape[1]
    H = np.asarray(np.kron(part.G.T @ part.G, np.eye(c)), np.float64)
    solution = solve_qp(H, -(part.G.T @ rest).ravel(), part.A, part.lower, part.upper, "daqp", _ITERATIONS)
    value = part.A @ solution.x
    return solution.x if bool(((value <= part.upper + MET) & (value >= part.lower - MET)).all()) else None


def _up_to(part: _Part, rank: int) -> _Part:
    """Returns the rows of this rank and of all lower ranks."""
    counted = part.ranks <= rank
    return part._replace(
        A=part.A[counted],
        lower=part.lower[counted],
        upper=part.upper[counted],
        ranks=part.ranks[counted],
    )


def _given_way(part: _Part, rank: int) -> _Part:
    """Returns the part with the rows of a rank widened by their violations, whose sum of squares is minimal.
    Rows of lower ranks are satisfied, and rows of higher ranks are ignored."""
    counted = _up_to(part, rank)
    A, lower, upper = counted.A, counted.lower, counted.upper
    yields = np.flatnonzero(counted.ranks == rank)
    if not yields.size:
        return part
    slack = np.zeros((len(A), yields.size))
    slack[yields, np.arange(yields.size)] = 1.0
    H = np.diag(np.r_[np.full(A.shape[1], _FAINT), np.ones(yields.size)])
    solution = solve_qp(H, np.zeros(len(H)), np.hstack([A, slack]), lower, upper, "daqp", _ITERATIONS)
    value = A @ solution.x[: A.shape[1]]
    missed = np.maximum(np.maximum(value - upper, lower - value), 0.0)
    missed[counted.ranks < rank] = 0.0
    missed[missed > 0.0] += MET  # with rounding errors, the widened rows stay feasible
    wider = np.zeros(len(part.A))
    wider[part.ranks <= rank] = missed
    return part._replace(lower=part.lower - wider, upper=part.upper + wider)


def _within(rows: Rows, wanted: Array) -> Array:
    """Returns increments whose torques are close to `wanted`, (N, n). They always satisfy the rows of torque.
    They also satisfy the rows of the torque rate, whenever any increments satisfy both kinds of rows, see
    `viable`.
    """
    N = len(wanted)
    blocks = {constraint: slice(k * N, (k + 1) * N) for k, constraint in enumerate(rows.constraints)}
    infinite = np.full(wanted.shape, np.inf)
    least, most = -infinite, infinite
    if TORQUE_RATE in blocks:
        least, most = rows.lower[blocks[TORQUE_RATE]], rows.upper[blocks[TORQUE_RATE]]
    lowest, highest = -infinite, infinite
    if TORQUE in blocks:
        lowest, highest = rows.lower[blocks[TORQUE]], rows.upper[blocks[TORQUE]]
    low, high = viable(lowest, highest, least, most)
    torque, before = np.empty_like(wanted), np.zeros(wanted.shape[1])
    for j in range(N):
        near = clamped(clamped(wanted[j], low[j], high[j]), before + least[j], before + most[j])
        before = torque[j] = clamped(near, lowest[j], highest[j])
    return steps(torque)

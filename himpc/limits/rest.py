"""Increments that satisfy all bounds whenever this is possible, and otherwise violate as little as possible:
joint by joint where no row couples joints, by QPs where rows do."""

from __future__ import annotations

from operator import is_
from typing import NamedTuple

import numpy as np

from himpc.limits.constraint import Constraint
from himpc.limits.position import POSITION
from himpc.limits.rows import Rows
from himpc.limits.torque import TORQUE
from himpc.limits.torque_rate import TORQUE_RATE
from himpc.limits.velocity import VELOCITY, summed_twice
from himpc.qp import solve_qp
from robots.arrays import Array, Indices


def steps(x: Array) -> Array:
    """Returns the steps x_j − x_{j−1}, where x_{−1} = 0."""
    return np.diff(x, axis=0, prepend=np.zeros((1, x.shape[1])))


def clamped(x: Array, low: Array, high: Array) -> Array:
    """Returns x clipped to the bounds. If the bounds contradict each other, the upper bound is satisfied."""
    return np.minimum(np.maximum(x, low), high)


def viable(low: Array, high: Array, least: Array, most: Array) -> tuple[Array, Array]:
    """Returns, for each x_j, the interval from which all later bounds can still be satisfied. The bounds are
    low ≤ x_j ≤ high and least ≤ x_j − x_{j−1} ≤ most, (N, n) each. The computation begins at the last
    knot."""
    low, high = low.copy(), high.copy()
    for j in range(len(low) - 2, -1, -1):
        behind_low, behind_high = low[j + 1] - most[j + 1], high[j + 1] - least[j + 1]
        low[j], high[j] = clamped(behind_low, low[j], high[j]), clamped(behind_high, low[j], high[j])
    return low, high


MET = 1e-7
"""A row whose violation is smaller than this, N·m, counts as satisfied."""
_ITERATIONS = 300
"""Largest number of iterations of the QP of a joint or of a group of joints."""
_WORK = 40_000
"""Largest product of unknowns and rows, over all QPs. If it is exceeded, the torque changes at fewer
knots."""
_ROWS = 1000
"""Largest number of rows of a group of coupled joints. If the group has more rows, its joints brake with
bounds on torque and torque rate only."""
FAINT = 1e-5
"""Weight of the changes of torque in the QPs that determine by how much rows give way."""


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
    ranks: Indices


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
        x = _closest_of_group(part, rest[:, group])
        if x is None:
            last = int(part.ranks.max())
            for rank in range(1, last + 1):
                if rank == last or _closest_of_group(_up_to(part, rank), rest[:, group]) is None:
                    part = _given_way(part, rank)
            x = _closest_of_group(part, rest[:, group])
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


def _closest_of_group(part: _Part, rest: Array) -> Array | None:
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
    H = np.diag(np.r_[np.full(A.shape[1], FAINT), np.ones(yields.size)])
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


_APART_ITERATIONS = 100
"""Largest number of iterations of the QP, which has one unknown for each joint and each direction."""


def kept_apart(rows: Rows, joints: int, U: Array) -> Array:
    """Returns U, (N, n) N·m, with a changed first increment. The change minimises, by least squares, the
    violation of the rows whose columns are not the joints. Rows of joints that U satisfies stay satisfied.

    A step of torque changes the value of a row in proportion to L[:, 0]. With one unknown x per joint, the
    joints' own rows become bounds on x, which x = 0 satisfies. The rows of a direction D_c become one bound
    on D_c·x: the tightest bound of all knots.

    Args:
        rows: all rows.
        joints: number of rows, from the first on, whose columns are the joints.
        U: the increments before the change.
    """
    N, n = U.shape
    profile, value = rows.L[:, :1], rows.values(U)
    with np.errstate(divide="ignore", invalid="ignore"):
        low = np.where(profile > 0.0, (rows.lower - value) / profile, -np.inf)
        high = np.where(profile > 0.0, (rows.upper - value) / profile, np.inf)
    least = np.minimum(low[:joints].max(axis=0), 0.0)
    most = np.maximum(high[:joints].min(axis=0), 0.0)
    D, lower, upper = [], [], []
    for index in range(joints // N, len(rows.constraints)):
        directions, block = (
            rows.directions[index] if rows.directions else None,
            slice(index * N, (index + 1) * N),
        )
        D.append(np.eye(n) if directions is None else directions.D)
        lower.append(low[block].max(axis=0))
        upper.append(high[block].min(axis=0))
    normals, lower, upper = np.vstack(D), np.concatenate(lower), np.concatenate(upper)
    if not ((lower > 0.0) | (upper < 0.0)).any():
        return U
    bounded = np.isfinite(lower) | np.isfinite(upper)
    normals, lower, upper = normals[bounded], lower[bounded], upper[bounded]
    c = len(normals)
    H = np.diag(np.r_[np.full(n, FAINT), np.ones(c)])
    A = np.block([[np.eye(n), np.zeros((n, c))], [normals, np.eye(c)]])
    solution = solve_qp(
        H, np.zeros(n + c), A, np.r_[least, lower], np.r_[most, upper], "daqp", _APART_ITERATIONS
    )
    moved = U.copy()
    if np.isfinite(solution.x).all():
        moved[0] += np.minimum(np.maximum(solution.x[:n], least), most)
    return moved


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
            closest = _closest_of_joint(rows, joint, rest[:, joint])
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


def _closest_of_joint(rows: Rows, joint: int, rest: Array) -> Array | None:
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

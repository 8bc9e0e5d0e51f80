"""One tick's QPs cut along the increments of two joints: a box, ellipses, lines and points.

All other variables of a QP (the other joints, later knots) have the values of one level's solution. In this
cut the cost of a level is (w − c)ᵀ P (w − c) + least, with w = (Δτ_a, Δτ_b) of knot 0 in N·m. The bounds are
a box, since rows of torque, velocity and position couple no joints. Rows of other constraints are left out if
they couple joints. The set that (33)
allows is the whole plane, a line, a point or empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from himpc.cascade.level import LevelProblem
from himpc.constants import RANK_TOLERANCE
from himpc.limits import Rows
from robots.arrays import Array

_HELD = 1e-9
"""N·m: a solution nearer to a cut than this counts as lying in it."""
_MET = 1e-7
"""N·m: largest violation of an equality that counts as rounding."""


@dataclass(frozen=True, eq=False)
class TorqueBox:
    """The box lower ≤ w ≤ upper, (2,) N·m, ±inf without a bound; kinds: per joint, the kinds of the limits at
    (lower, upper), None without a bound."""

    lower: Array
    upper: Array
    kinds: tuple[tuple[str | None, str | None], tuple[str | None, str | None]]

    def inside(self, w: Array, room: float = 0.0) -> bool:
        """Returns whether w is in the box, or at most `room` outside it, N·m."""
        return bool((self.lower - room <= w).all() and (w <= self.upper + room).all())


@dataclass(frozen=True, eq=False)
class Allowed:
    """The part of the plane that (33) allows: the points at + span·s. If `at` is None, (33) allows no point
    of the plane.

    Attributes:
        at: (2,) a point of it, N·m.
        span: (2, d) orthonormal; d = 2: the whole plane, 1: a line, 0: a point.
    """

    at: Array | None
    span: Array

    def segment(self, box: TorqueBox) -> Array | None:
        """Returns the ends (2, 2) of the part of the line that is in the box, ±inf for an end without a
        bound. None if there is no such part, or if the allowed points are not a line."""
        if self.at is None or self.span.shape[1] != 1:
            return None
        low, high = _stretch(self.at, self.span[:, 0], box)
        if low > high:
            return None
        return np.array([self.at + s * self.span[:, 0] for s in (low, high)])


@dataclass(frozen=True, eq=False)
class LevelCut:
    """A level in the cut.

    Attributes:
        name: of the level.
        P: (2, 2), the cost's curvature, 1/(N·m)².
        centre: (2,) N·m, the minimum of the cost without bounds and without levels above.
        least: the cost at `centre`.
        allowed: the set that the levels above leave.
        optimum: (2,) N·m, the best allowed point of the box, computed from this geometry alone; None if there
            is none.
        solved: (2,) N·m, the controller's own solution.
        apart: distance of `solved` from the cut, N·m, in the directions that change the cost of this level or
            of a level above; if it is 0, `optimum` and `solved` are equal.
        leaves: the set that (33) leaves to the levels below this one.
    """

    name: str
    P: Array
    centre: Array
    least: float
    allowed: Allowed
    optimum: Array | None
    solved: Array
    apart: float
    leaves: Allowed

    def cost(self, w: Array) -> float:
        """Returns the cost at a point of the plane."""
        away = w - self.centre
        return float(away @ self.P @ away) + self.least

    def ellipse(self, through: Array) -> tuple[float, float, float]:
        """Returns the contour of the cost through a point: its semi-axes (N·m), the longer one first, and the
        angle from the first joint's axis to the longer one, rad."""
        away = through - self.centre
        values, axes = np.linalg.eigh(self.P)
        radii = np.sqrt(float(away @ self.P @ away) / np.maximum(values, 1e-300))
        return float(radii[0]), float(radii[1]), float(np.arctan2(axes[1, 0], axes[0, 0]))


@dataclass(frozen=True, eq=False)
class Plane:
    """A cut through one tick.

    Attributes:
        joints: the two joints, counted from 0.
        box: the bounds.
        levels: highest priority first.
        weighted: (2,) N·m, the optimum of one weighted cost of all tasks; None if there is none.
        osf: (2,) N·m, the change of torque that OSF demands.
    """

    joints: tuple[int, int]
    box: TorqueBox
    levels: tuple[LevelCut, ...]
    weighted: Array | None = None
    osf: Array | None = None

    @property
    def apart(self) -> float:
        """The largest distance between the optimum by geometry and the solver's solution, N·m, over the
        levels whose solution lies in the cut."""
        return max(
            (
                float(np.abs(level.optimum - level.solved).max())
                for level in self.levels
                if level.optimum is not None and level.apart <= _HELD
            ),
            default=float("nan"),
        )


def cut(
    problems: Sequence[LevelProblem],
    rows: Rows,
    increments: Sequence[Array],
    joints: tuple[int, int],
    held: Array,
) -> Plane:
    """Returns the plane of two joints' first increments.

    Args:
        problems: of all levels, highest priority first.
        rows: the bounds of these problems.
        increments: U_i of every level, (N, n) N·m.
        joints: the two joints.
        held: (N, n) N·m, the values of all other variables.
    """
    pair = list(joints)
    box = _box(rows, pair, held)
    levels: list[LevelCut] = []
    allowed = Allowed(held[0, pair], np.eye(2))
    B = np.empty((0, held.shape[1]))
    wanted = np.empty(0)
    for problem, U in zip(problems, increments, strict=True):
        P, centre, least = _cost(problem, pair, held)
        B = np.vstack([B, problem.B[0]])
        wanted = np.append(wanted, problem.B[0] @ U[0])
        leaves = _left(B, wanted, pair, held[0])
        away = U - held
        away[0, pair] = 0.0
        effect = np.abs(B @ away[0]).max() / max(float(np.linalg.norm(B)), 1e-300)
        levels.append(
            LevelCut(
                name=problem.name,
                P=P,
                centre=centre,
                least=least,
                allowed=allowed,
                optimum=best(P, centre, allowed, box),
                solved=U[0, pair],
                apart=float(max(effect, np.abs(away[1:]).max(initial=0.0))),
                leaves=leaves,
            )
        )
        allowed = leaves
    return Plane(joints, box, tuple(levels))


def _cost(problem: LevelProblem, pair: list[int], held: Array) -> tuple[Array, Array, float]:
    """P, c and the least value of (32a) or (34a) over the two increments."""
    moved = held.copy()
    moved[0, pair] = 0.0
    K = problem.knots
    # ∂e/∂w for the two increments: (K·m, 2).
    G = (problem.C[:K, :, 0, None] * problem.B[0][None]).reshape(-1, held.shape[1])[:, pair]
    Q = np.tile(problem.root_Q**2, K)
    e = problem.residual(moved)[:K].ravel()
    P = G.T @ (Q[:, None] * G) + np.diag(problem.R[pair])
    centre = -np.linalg.solve(P, G.T @ (Q * e))
    moved[0, pair] = centre
    return P, centre, problem.cost(moved)


def _box(rows: Rows, pair: list[int], held: Array) -> TorqueBox:
    rest = held.copy()
    rest[0, pair] = 0.0
    touching = np.array([row for row in np.flatnonzero(rows.L[:, 0]) if rows.directions_of(row) is None])
    slope = rows.L[touching, 0][:, None]
    taken = rows.values(rest)[touching][:, pair]
    lower, upper = ((side[touching][:, pair] - taken) / slope for side in (rows.lower, rows.upper))

    def kind(values: Array, k: int, up: bool) -> str | None:
        row = int(values[:, k].argmin() if up else values[:, k].argmax())
        if not np.isfinite(values[row, k]):
            return None
        return rows.constraint(int(touching[row]), pair[k], up).label

    return TorqueBox(
        lower.max(axis=0),
        upper.min(axis=0),
        (
            (kind(lower, 0, False), kind(upper, 0, True)),
            (kind(lower, 1, False), kind(upper, 1, True)),
        ),
    )


def _left(B: Array, wanted: Array, pair: list[int], held: Array) -> Allowed:
    """Returns the set {w: B u = wanted} of (33) at knot 0, with the values of the other joints fixed."""
    others = held.copy()
    others[pair] = 0.0
    A, b = B[:, pair], wanted - B @ others
    size = float(np.linalg.norm(B))
    left, sigma, right = np.linalg.svd(A)
    rank = int((sigma > RANK_TOLERANCE * size).sum())
    at = right[:rank].T @ ((left[:, :rank].T @ b) / sigma[:rank])
    # A distance in N·m that no choice of w can reduce.
    missed = float(np.abs(A @ at - b).max(initial=0.0)) / max(size, 1e-300)
    return Allowed(at if missed <= _MET else None, right[rank:].T)


def best(P: Array, centre: Array, allowed: Allowed, box: TorqueBox) -> Array | None:
    """Returns the point of `allowed` in the box where (w − c)ᵀ P (w − c) is least; None if there is none."""
    at, span = allowed.at, allowed.span
    if at is None or (box.lower > box.upper + _MET).any():
        return None
    if span.shape[1] == 0:
        return at if box.inside(at, _MET) else None
    if span.shape[1] == 1:
        return _best_on(P, centre, at, span[:, 0], box)
    if box.inside(centre):
        return centre
    edges = []
    for axis in (0, 1):
        for end in (box.lower[axis], box.upper[axis]):
            if np.isfinite(end):
                corner = np.zeros(2)
                corner[axis] = end
                edges.append(_best_on(P, centre, corner, np.eye(2)[1 - axis], box))
    points = [w for w in edges if w is not None]
    return min(points, key=lambda w: float((w - centre) @ P @ (w - centre)), default=None)


def _best_on(P: Array, centre: Array, at: Array, along: Array, box: TorqueBox) -> Array | None:
    """Returns the best point of a line in the box."""
    low, high = _stretch(at, along, box)
    if low > high + _MET:
        return None
    s = float(along @ P @ (centre - at)) / float(along @ P @ along)
    return at + min(max(s, low), max(low, high)) * along


def _stretch(at: Array, along: Array, box: TorqueBox) -> tuple[float, float]:
    """Returns the interval of s in which at + s·along is in the box; if the interval is empty, its first
    bound exceeds its second.
    """
    low, high = -np.inf, np.inf
    for axis in (0, 1):
        if abs(along[axis]) < 1e-14:
            if not box.lower[axis] - _MET <= at[axis] <= box.upper[axis] + _MET:
                return np.inf, -np.inf
            continue
        ends = sorted((side[axis] - at[axis]) / along[axis] for side in (box.lower, box.upper))
        low, high = max(low, ends[0]), min(high, ends[1])
    return float(low), float(high)

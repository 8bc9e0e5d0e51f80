"""Computes the optimum of every level of a hierarchy to far more digits than a double has. The results are
the reference for the kernel and the printed equations.

Only the problem's data come from `himpc`. For a set of active rows the optimality conditions of (32) or (34),
with (33) as printed, are linear. They are solved in doubles. The solution is then corrected until its
residuals vanish. The residuals are evaluated in integers of several hundred bits. The dual method of Goldfarb
and Idnani finds the set of active rows. It starts from a guess if all multipliers of the guess have the right
signs. Otherwise it starts without any row. The cost is strictly convex, so a point that satisfies the
conditions is the optimum for any guess.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from himpc.cascade.level import ActiveRows, LevelProblem
from himpc.limits.rows import Rows

Array = NDArray[np.float64]
Fixed = NDArray[Any]
"""Integers of arbitrary length, which represent numbers times 2^_BITS."""

_BITS = 300
_RANK = 1e-10
"""Lower levels may use a direction, as in himpc, if its effect on a level is less than this share of the
level's rows."""
_DEPENDENT = 1e-13
"""A bound counts as dependent on the held rows if at most this share of it is independent of these rows."""
_BEYOND = 1e-11
"""The torque, N·m, by which a dependent row may exceed its bound, since the data are doubles."""
_CORRECTIONS = 60
_CHANGES = 400


@dataclass(frozen=True, eq=False)
class Exact:
    """The optimum of a level.

    Attributes:
        U: the changes of torque (N, n), N·m, rounded to doubles.
        fixed: U as fixed-point numbers, not rounded.
        active: the number of active bounds.
    """

    U: Array
    fixed: Fixed
    active: int


def fixed(x: Any) -> Fixed:
    """Converts doubles to integers times 2^_BITS."""
    return np.asarray(np.frompyfunc(lambda v: int(math.ldexp(v, _BITS)), 1, 1)(np.asarray(x, np.float64)))


def rounded(x: Fixed) -> Array:
    """Converts integers times 2^_BITS to doubles."""
    return np.asarray(np.frompyfunc(lambda v: v / (1 << _BITS), 1, 1)(x), np.float64)


def times(a: Fixed, b: Fixed) -> Fixed:
    """Returns the matrix product of two fixed-point arrays."""
    return (a @ b) >> _BITS


def optimum(
    problem: LevelProblem, rows: Rows, above: Sequence[tuple[LevelProblem, Exact]], guess: ActiveRows
) -> Exact | None:
    """Returns the optimum of Problem i; None if it is not found within `_CHANGES` changes of the held rows.

    Args:
        problem: the data of Problem i.
        rows: all bounds.
        above: the levels above and their optima, highest priority first.
        guess: rows that may bind.
    """
    system = _System(problem, rows, above)
    side = np.zeros(rows.lower.shape)
    side[guess.row, guess.joint] = np.sign(guess.multiplier)
    side[~system.independent(side)] = 0.0
    start = system.solve(side)
    if start is None or (side * start.multipliers).min() < -1e-13 * np.abs(start.multipliers).max():
        side[:] = 0.0
        start = system.solve(side)
    return None if start is None else _dual_method(system, start, side)


def _dual_method(system: _System, point: _Point, side: Array) -> Exact | None:
    """Runs Goldfarb and Idnani's method from a point whose multipliers have the right signs.

    Multipliers change linearly between the present point and the point that holds one more row. At the step
    at which the first multiplier vanishes, its row is released, and the method continues from there.
    """
    for _ in range(_CHANGES):
        value = times(system.L, point.U)
        over, under = rounded(value - system.upper), rounded(system.lower - value)
        beyond = np.where(side != 0.0, 0.0, np.maximum(over, under))
        new = np.unravel_index(beyond.argmax(), side.shape)
        if beyond[new] <= _BEYOND:
            return Exact(rounded(point.U), point.U, int((side != 0.0).sum()))
        sign, multipliers = 1.0 if over[new] > under[new] else -1.0, point.multipliers
        while True:
            shares = system.dependence(side, new)
            if shares is None:
                side[new] = sign
                following = system.solve(side)
                if following is None:
                    return None
                change = following.multipliers - multipliers
            else:  # the point stays, and multipliers move from the held rows to the new row
                following, change = None, sign * shares
            step, leaving = _first_to_vanish(side, new, multipliers, change)
            if following is not None and step >= 1.0:
                point = following
                break
            if leaving is None:  # no point satisfies this row and the held rows
                return None
            multipliers = multipliers + step * change
            multipliers[leaving] = side[leaving] = 0.0
    return None


def _first_to_vanish(
    side: Array, new: tuple[Any, ...], multipliers: Array, change: Array
) -> tuple[float, tuple[Any, ...] | None]:
    """Returns the step at which the first multiplier of a held row vanishes, and this row."""
    shrinks = (side != 0.0) & (side * change < 0.0)
    shrinks[new] = False
    if not shrinks.any():
        return np.inf, None
    steps = np.full(side.shape, np.inf)
    steps[shrinks] = np.abs(multipliers[shrinks]) / np.abs(change[shrinks])
    leaving = np.unravel_index(steps.argmin(), side.shape)
    return float(steps[leaving]), leaving


@dataclass(frozen=True, eq=False)
class _Point:
    """The solution of the conditions for a set of held rows: U (N, n), and a multiplier per row."""

    U: Fixed
    multipliers: Array


class _Corrector:
    """Solves v + Aᵀe + Cᵀλ = r₁, A v − e = r₂, C v = r₃ in doubles by QR factorisations, without squaring A
    or C."""

    def __init__(self, A: Array, C: Array) -> None:
        self._A, self._count = A, len(C)
        Q, R = np.linalg.qr(C.T, mode="complete")
        self._R, self._held, self._free = R[: len(C)], Q[:, : len(C)], Q[:, len(C) :]
        self._F = np.linalg.qr(np.vstack([A @ self._free, np.eye(self._free.shape[1])]), mode="r")

    def solve(self, right: Array) -> Array:
        """Returns the solution (v, e, λ) for the right-hand sides (r₁, r₂, r₃)."""
        d, k = self._A.shape[1], len(self._A)
        r1, r2, r3 = right[:d], right[d : d + k], right[d + k :]
        v = self._held @ solve_triangular(self._R, r3, trans=1) if self._count else np.zeros(d)
        if self._free.shape[1]:
            rest = self._free.T @ (r1 - v - self._A.T @ (self._A @ v - r2))
            v = v + self._free @ solve_triangular(self._F, solve_triangular(self._F, rest, trans=1))
        e = self._A @ v - r2
        press = self._held.T @ (r1 - v - self._A.T @ e)
        return np.concatenate([v, e, solve_triangular(self._R, press) if self._count else press])


class _System:
    """The linear optimality conditions of one level."""

    def __init__(
        self, problem: LevelProblem, rows: Rows, above: Sequence[tuple[LevelProblem, Exact]]
    ) -> None:
        self._problem = problem
        self._K, (self._N, _, self._n) = problem.knots, problem.B.shape
        self.L = fixed(rows.L)
        finite = [
            np.where(np.isfinite(bound), bound, np.copysign(1e30, bound))
            for bound in (rows.lower, rows.upper)
        ]
        self.lower, self.upper = fixed(finite[0]), fixed(finite[1])
        self._before = above[-1][1].fixed if above else fixed(np.zeros((self._N, self._n)))
        if above:
            at = times(self.L, self._before)
            self.lower, self.upper = np.minimum(self.lower, at), np.maximum(self.upper, at)
        self._B, self._free = fixed(problem.B), fixed(problem.free)
        self._C, self._root_Q, self._R = fixed(problem.C), fixed(problem.root_Q), fixed(problem.R)
        self._root_R = np.sqrt(problem.R)
        self._kept = [self._kept_at(j, [each.B[j] for each, _ in above]) for j in range(self._K)]
        self._kept_fixed = [fixed(rows) for rows in self._kept]
        self._L = rows.L

    def _kept_at(self, knot: int, above: list[Array]) -> Array:
        """Returns the independent rows of (33) at a knot, as printed."""
        chosen = np.empty((0, self._n))
        basis = np.empty((self._n, 0))
        for B in above:
            size = float(np.linalg.norm(B / self._root_R))
            scaled = B / self._root_R
            left = scaled - (scaled @ basis) @ basis.T
            while True:
                length = np.linalg.norm(left, axis=1)
                best = int(length.argmax())
                if length[best] <= _RANK * size or basis.shape[1] == self._n:
                    break
                new = left[best] / length[best]
                new = new - basis @ (basis.T @ new)
                basis = np.column_stack([basis, new / np.linalg.norm(new)])
                chosen = np.vstack([chosen, B[best]])
                left = scaled - (scaled @ basis) @ basis.T
        return chosen

    def solve(self, side: Array) -> _Point | None:
        """Returns the point at which independent rows are held at their upper (1) or lower (−1) bounds; None
        if the conditions do not determine the point."""
        K, n = self._K, self._n
        row, joint = np.nonzero(side)
        bound = np.where(side > 0, self.upper, self.lower)[row, joint]
        if any(abs(b) >= int(1e29) << _BITS for b in bound):
            return None
        A = self._effects()
        E = self._scaled_rows(row, joint)
        size = np.linalg.norm(E, axis=1)
        d, k, c = A.shape[1], len(A), len(E)
        solver = _Corrector(A, E / size[:, None])
        U, e, pull = self._before.copy(), fixed(np.zeros((K, k // K))), fixed(np.zeros(c))
        scale = np.concatenate([1.0 / np.tile(self._root_R, K), np.ones(k), 1.0 / size])
        last = math.inf
        for _ in range(_CORRECTIONS):
            missing = -np.concatenate(self._missing(U, e, pull, row, joint, bound)) * scale
            if not missing.any():
                break
            most = np.abs(missing).max()
            change = solver.solve(missing) * scale
            if not np.isfinite(change).all() or not most < 1e3 * last:
                return None
            last = min(last, most)
            U[:K] += fixed(change[:d].reshape(K, n))
            e += fixed(change[d : d + k].reshape(e.shape))
            pull += fixed(change[d + k :])
            # One unit in the last place of the result, with many spare digits.
            if np.abs(change[:d]).max() < 1e-30 * (1.0 + np.abs(rounded(U)).max()):
                break
        else:
            return None
        multipliers = np.zeros(side.shape)
        multipliers[row, joint] = rounded(pull[: len(row)])
        return _Point(U, multipliers)

    def _missing(
        self, U: Fixed, e: Fixed, pull: Fixed, row: NDArray[Any], joint: NDArray[Any], bound: Fixed
    ) -> list[Array]:
        """Returns the residuals of the conditions, rounded at the end: stationarity, e, and held rows."""
        K = self._K
        pushed = np.array([times(self._B[j], U[j]) for j in range(self._N)])
        error = np.array(
            [
                (self._root_Q * (self._free[k] + ((self._C[k] * pushed[: self._N].T).sum(axis=1) >> _BITS)))
                >> _BITS
                for k in range(K)
            ]
        )
        weighted = (self._root_Q * e) >> _BITS
        gradient = (self._R * U[:K]) >> _BITS
        for j in range(K):
            gathered = (self._C[:K, :, j] * weighted).sum(axis=0) >> _BITS
            gradient[j] += times(gathered, self._B[j])
        for r, a, each in zip(row, joint, pull[: len(row)], strict=True):
            gradient[:, a] += (self.L[r, :K] * each) >> _BITS
        value = times(self.L, U)[row, joint] - bound if len(row) else np.empty(0, object)
        rest = [value]
        at = len(row)
        for j, rows in enumerate(self._kept_fixed):
            if len(rows):
                gradient[j] += times(pull[at : at + len(rows)], rows)
                rest.append(times(rows, U[j] - self._before[j]))
                at += len(rows)
        parts = [gradient.ravel(), (error - e).ravel(), np.concatenate(rest)]
        return [rounded(part) for part in parts]

    def _effects(self) -> Array:
        """Returns √Q C B R^−½, (K·m, K·n)."""
        p, K = self._problem, self._K
        G = p.C[:K, :, :K, None] * p.B[:K].transpose(1, 0, 2)[None]
        weighted = p.root_Q[None, :, None, None] * G / self._root_R
        return weighted.reshape(K * p.B.shape[1], K * self._n)

    def _scaled_rows(self, row: NDArray[Any], joint: NDArray[Any]) -> Array:
        """Returns the rows of bounds, then of (33), times R^−½, (c, K·n)."""
        K, n = self._K, self._n
        kept = sum(map(len, self._kept))
        rows = np.zeros((len(row) + kept, K, n))
        rows[np.arange(len(row)), :, joint] = self._L[row, :K] / self._root_R[joint, None]
        at = len(row)
        for j, each in enumerate(self._kept):
            rows[at : at + len(each), j] = each / self._root_R
            at += len(each)
        return rows.reshape(len(rows), K * n)

    def independent(self, side: Array) -> NDArray[np.bool_]:
        """Returns a largest subset of the given rows that is linearly independent, also of the rows of
        (33)."""
        row, joint = np.nonzero(side)
        held = np.zeros(side.shape, bool)
        if not len(row):
            return held
        bounds, basis, _ = self._directions(row, joint, len(row))
        for _ in range(2):
            bounds = bounds - (bounds @ basis) @ basis.T
        factors: Any = qr(bounds.T, mode="economic", pivoting=True)
        R, order = factors[1:]
        chosen = order[: len(R)][np.abs(np.diag(R)) > _DEPENDENT]
        held[row[chosen], joint[chosen]] = True
        return held

    def dependence(self, side: Array, new: tuple[Any, ...]) -> Array | None:
        """Returns the changes of the held rows' multipliers per unit of the new row's multiplier. This
        requires that the new row depends on the held rows and on (33). If it is independent of them, returns
        None."""
        held = side != 0.0
        held[new] = False
        row, joint = (np.append(*pair) for pair in zip(new, np.nonzero(held), strict=True))
        (direction,), basis, size = self._directions(row, joint, 1)
        left = direction
        for _ in range(2):
            left = left - basis @ (basis.T @ left)
        if np.linalg.norm(left) > _DEPENDENT:
            return None
        others = self._scaled_rows(row, joint)[1:] / size[1:, None]
        parts = np.linalg.lstsq(others.T, direction, rcond=None)[0][: len(row) - 1]
        shares = np.zeros(side.shape)
        shares[row[1:], joint[1:]] = -parts * size[0] / size[1 : len(row)]
        shares[new] = 1.0
        return shares

    def _directions(self, row: NDArray[Any], joint: NDArray[Any], count: int) -> tuple[Array, Array, Array]:
        """Returns the first `count` rows as unit vectors, an orthonormal basis of the other rows, and the
        lengths of all rows."""
        rows = self._scaled_rows(row, joint)
        size = np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
        unit = rows / size[:, None]
        basis = np.linalg.qr(unit[count:].T)[0] if len(unit) > count else np.zeros((rows.shape[1], 0))
        return unit[:count], basis, size

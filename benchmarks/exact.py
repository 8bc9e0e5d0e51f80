"""The optimum of every level of a hierarchy to far more digits than a double has: the reference for both
routes.

Only the problem's data come from `himpc`. A set of active rows is guessed. Under these rows the optimality
conditions of (32) or (34), with (33) as printed, are linear: they are solved in doubles, and corrected until
their residuals, evaluated in integers of several hundred bits, vanish. The guess was right if no other row
exceeds its bound and every multiplier has the right sign. The cost is strictly convex, so a point that
satisfies the conditions is the optimum, whatever the guess was.
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
"""A direction whose effect on a level is below this share of its rows is left to lower levels, as in
himpc."""
_DEPENDENT = 1e-9
"""A bound depends on the rows that are held if at most this share of it is independent of them."""
_BEYOND = 1e-11
"""N·m by which a dependent row may exceed its bound, since the data are doubles."""
_CORRECTIONS = 60
_CHANGES = 60


@dataclass(frozen=True, eq=False)
class Exact:
    """The optimum of a level.

    Attributes:
        U: (N, n) N·m, rounded.
        fixed: the same, not rounded.
        active: how many bounds hold it.
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
    """The matrix product of two fixed-point arrays."""
    return (a @ b) >> _BITS


def optimum(
    problem: LevelProblem, rows: Rows, above: Sequence[tuple[LevelProblem, Exact]], guess: ActiveRows
) -> Exact | None:
    """The optimum of Problem i; None if the initial guess and `_CHANGES` changes of it do not lead to one.

    Args:
        problem: its data.
        rows: all bounds.
        above: the levels above and their optima, highest priority first.
        guess: rows that may bind.
    """
    system = _System(problem, rows, above)
    side = np.zeros(rows.lower.shape)
    side[guess.row, guess.joint] = np.sign(guess.multiplier)
    for _ in range(_CHANGES):
        found = system.solve(side)
        if found is None:
            return None
        U, held, pull = found
        wrong = np.where(held, -side * pull, 0.0)
        side = np.where(held, side, 0.0)  # rows that depend on those held are satisfied without being held
        if wrong.max(initial=0.0) > 1e-13 * np.abs(pull).max():
            side[np.unravel_index(wrong.argmax(), side.shape)] = 0.0
            continue
        value = times(system.L, U)
        over, under = rounded(value - system.upper), rounded(system.lower - value)
        beyond = np.where(held, 0.0, np.maximum(over, under))
        if beyond.max() <= _BEYOND:
            return Exact(rounded(U), U, int(held.sum()))
        worst = np.unravel_index(beyond.argmax(), side.shape)
        side[worst] = 1.0 if over[worst] > under[worst] else -1.0
    return None


class _Corrector:
    """Solves v + Aᵀe + Cᵀλ = r₁, A v − e = r₂, C v = r₃ in doubles by QR factorisations, without squaring A
    or C."""

    def __init__(self, A: Array, C: Array) -> None:
        self._A, self._count = A, len(C)
        Q, R = np.linalg.qr(C.T, mode="complete")
        self._R, self._held, self._free = R[: len(C)], Q[:, : len(C)], Q[:, len(C) :]
        self._F = np.linalg.qr(np.vstack([A @ self._free, np.eye(self._free.shape[1])]), mode="r")

    def solve(self, right: Array) -> Array:
        """The solution (v, e, λ) for the right-hand sides (r₁, r₂, r₃)."""
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
        """The independent rows of (33) at a knot, as printed."""
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

    def solve(self, side: Array) -> tuple[Fixed, NDArray[np.bool_], Array] | None:
        """U (N, n), which rows are held, and all multipliers, for rows held at their upper (1) or lower (−1)
        bounds; None if the conditions do not determine them."""
        K, n = self._K, self._n
        held = self._independent(side)
        row, joint = np.nonzero(held)
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
        return U, held, multipliers

    def _missing(
        self, U: Fixed, e: Fixed, pull: Fixed, row: NDArray[Any], joint: NDArray[Any], bound: Fixed
    ) -> list[Array]:
        """The residuals of the conditions, rounded only at the end: stationarity, e, and rows held."""
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
        """√Q C B R^−½, (K·m, K·n)."""
        p, K = self._problem, self._K
        G = p.C[:K, :, :K, None] * p.B[:K].transpose(1, 0, 2)[None]
        weighted = p.root_Q[None, :, None, None] * G / self._root_R
        return weighted.reshape(K * p.B.shape[1], K * self._n)

    def _scaled_rows(self, row: NDArray[Any], joint: NDArray[Any]) -> Array:
        """Rows of bounds, then of (33), times R^−½, (c, K·n)."""
        K, n = self._K, self._n
        kept = sum(map(len, self._kept))
        rows = np.zeros((len(row) + kept, K, n))
        rows[np.arange(len(row)), :, joint] = self._L[row, :K] / self._root_R[joint, None]
        at = len(row)
        for j, each in enumerate(self._kept):
            rows[at : at + len(each), j] = each / self._root_R
            at += len(each)
        return rows.reshape(len(rows), K * n)

    def _independent(self, side: Array) -> NDArray[np.bool_]:
        """The rows to be held that depend neither on (33) nor on one another."""
        row, joint = np.nonzero(side)
        held = np.zeros(side.shape, bool)
        if not len(row):
            return held
        rows = self._scaled_rows(row, joint)
        bounds, kept = rows[: len(row)], rows[len(row) :]
        bounds = bounds / np.maximum(np.linalg.norm(bounds, axis=1, keepdims=True), 1e-300)
        if len(kept):
            basis, _ = np.linalg.qr((kept / np.linalg.norm(kept, axis=1, keepdims=True)).T)
            for _ in range(2):
                bounds = bounds - (bounds @ basis) @ basis.T
        factors: Any = qr(bounds.T, mode="economic", pivoting=True)
        R, order = factors[1:]
        chosen = order[: len(R)][np.abs(np.diag(R)) > _DEPENDENT]
        held[row[chosen], joint[chosen]] = True
        return held

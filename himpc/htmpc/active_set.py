"""A dual active-set method (Goldfarb and Idnani) for min ½xᵀHx + gᵀx under lower ≤ Ax ≤ upper, compiled.

With H = LLᵀ and z = Lᵀx the cost is ½‖z − z₀‖², and the coefficients of a row become L⁻¹a. The method starts
at the unconstrained optimum and adds violated rows one by one, the most violated row first. HIMPC solves its
levels by the same steps, see `himpc.tick.kernel.goldfarb_idnani`. Equalities are never removed. A row that
depends linearly on the active rows does not enlarge their basis, so either it replaces one of them or the
rows contradict each other.
"""

from __future__ import annotations

from time import perf_counter_ns

import numpy as np

from himpc.htmpc.kernel.active_set import VECTORS, factor, solve
from himpc.htmpc.rows import ConstraintRows
from himpc.qp import QPSolution
from robots.arrays import Array

CONTRADICTION = "contradiction"
"""The status of a QP that has no feasible point."""
_STATUS = ("optimal", CONTRADICTION, "limit")


class ActiveSetSolver:
    """A solver that stores one Hessian and the active rows of its last solution. The next QP begins with
    these rows."""

    def __init__(self) -> None:
        self._room(0)

    def _room(self, n: int) -> None:
        self._L, self._count = np.empty((n, n)), 0
        self._held, self._vectors = np.zeros((3, n + 1), np.int64), np.empty((VECTORS, n + 1))
        self._normals, self._cholesky_factor = np.empty((3, n + 1, n)), np.empty((n + 1, n + 1))

    def begin(self, H: Array) -> bool:
        """Factors a Hessian (k, k) and clears the active rows. Returns False if the Hessian is not positive
        definite."""
        if len(H) != len(self._L):
            self._room(len(H))
        self._H, self._count = H, 0
        return factor(H, self._L)

    def solve(self, g: Array, rows: ConstraintRows, same: int) -> QPSolution:
        """Solves min ½xᵀHx + gᵀx under the rows; lower = upper is an equality.

        Args:
            g: (k,), the gradient. rows: the constraints, with k columns.
            same: the number of rows, from the first on, that are equal to those of the previous QP.
        """
        started = perf_counter_ns()
        if (self._held[0, : self._count] >= same).any():
            self._count = 0
        k, count = len(g), len(rows.A)
        x, multipliers = np.empty(k), np.zeros(count)
        residual, status, self._count = solve(
            *(self._L, self._H, g, np.ascontiguousarray(rows.A), rows.lower, rows.upper),
            *(self._held, self._count, self._normals, self._cholesky_factor, self._vectors),
            *(np.empty(count, np.intp), np.empty(count), x, multipliers),
        )
        time_us = (perf_counter_ns() - started) / 1e3
        return QPSolution(x, multipliers, residual, _STATUS[status], time_us)

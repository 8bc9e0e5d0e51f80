"""A dual active-set method (Goldfarb and Idnani) for min ½xᵀHx + gᵀx under lower ≤ Ax ≤ upper, compiled.

With H = LLᵀ and z = Lᵀx the cost is ½‖z − z₀‖², and a row a becomes nᵀz ≥ β with n = ±L⁻¹a. The method starts
at the unconstrained optimum and adds violated rows one by one, the most violated row first. Rows whose
multiplier would become negative are removed. The active rows are stored as combinations of orthonormal ones.
A row that depends on them does not enlarge this basis, so it replaces one of them, or the rows contradict
each other.
"""

from __future__ import annotations

from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.kernel.active_set import SCRATCH, factor, solve
from himpc.htmpc.rows import ConstraintRows
from himpc.qp import QPSolution

Array = NDArray[np.float64]

CONTRADICTION = "contradiction"
"""The status of a QP without a feasible point."""
_STATUS = ("optimal", CONTRADICTION, "limit")


class ActiveSetSolver:
    """One Hessian, and the active rows of the last solution, with which the next QP begins."""

    def __init__(self) -> None:
        self._room(0)

    def _room(self, n: int) -> None:
        self._L = np.empty((n, n))
        self._active, self._side = np.empty(n, np.intp), np.empty(n)
        self._corner, self._basis = np.empty((n + 1, n + 1)), np.empty((n + 1, n))
        self._scratch, self._watched = np.empty((SCRATCH, n + 1)), np.empty(0, np.intp)
        self._count = 0

    def begin(self, H: Array) -> bool:
        """Factors a Hessian (k, k) and clears the active rows. Returns False if it is not positive
        definite."""
        if len(H) != len(self._active):
            self._room(len(H))
        self._H, self._count = H, 0
        return factor(H, self._L)

    def solve(self, g: Array, rows: ConstraintRows, same: int) -> QPSolution:
        """Solves min ½xᵀHx + gᵀx under the rows; lower = upper is an equality.

        Args:
            g: (k,). rows: of k columns.
            same: number of the first rows that are the same as in the QP before.
        """
        started = perf_counter_ns()
        held = self._active[: self._count]
        if (held >= same).any():
            self._count = 0
        k, count = len(g), len(rows.A)
        if count > len(self._watched):
            self._watched = np.empty(2 * count, np.intp)
        x, multipliers = np.empty(k), np.zeros(count)
        residual, status, self._count = solve(
            *(self._L, self._H, g, np.ascontiguousarray(rows.A), rows.lower, rows.upper),
            *(self._active, self._side, self._count, self._corner, self._basis, self._scratch),
            *(self._watched, np.zeros(count, np.intp), x, multipliers),
        )
        time_us = (perf_counter_ns() - started) / 1e3
        return QPSolution(x, multipliers, residual, _STATUS[status], time_us)

"""Solves QPs with few active rows: it starts with the rows that are probably active and adds the violated
ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from himpc.qp import QPSolution, Solver, solve_qp

Array = NDArray[np.float64]

_CLOSE = 0.05
"""Rows whose bound is nearer to x = 0 than this share of their range, or of one unit, start in the set."""
_SATISFIED = 1e-9
_ROUNDS = 8


def solve_by_working_set(
    H: Array, f: Array, A: Array, lower: Array, upper: Array, first: NDArray[np.bool_], solver: Solver
) -> QPSolution:
    """Calls `solve_qp` with growing sets of rows until all rows are satisfied; the result is the solution of
    the whole problem.

    A QP on fewer rows costs less, and if its solution satisfies the others too it solves the whole one, with
    zero for their multipliers. A set that contradicts itself makes the whole problem infeasible.

    Args:
        H, f, A, lower, upper, solver: as for `solve_qp`; x = 0 is a good guess of the solution.
        first: rows that are in the set from the start, whatever their bounds.

    Returns:
        the solution with multipliers of all rows; its residual includes rows outside the set.
    """
    near = _CLOSE * np.minimum(upper - lower, 1.0)
    chosen = first | (lower > -near) | (upper < near)
    time_us = 0.0
    for _ in range(_ROUNDS):
        solution = solve_qp(H, f, A[chosen], lower[chosen], upper[chosen], solver)
        time_us += solution.time_us
        if not solution.solved:
            break
        value = A @ solution.x
        excess = np.maximum(lower - value, value - upper)
        excess[chosen] = 0.0
        worst = float(excess.max(initial=0.0))
        if worst <= _SATISFIED:
            multipliers = np.zeros(len(A))
            multipliers[chosen] = solution.multipliers
            residual = max(solution.kkt_residual, worst)
            return replace(solution, multipliers=multipliers, kkt_residual=residual, time_us=time_us)
        chosen |= excess > _SATISFIED
    whole = solve_qp(H, f, A, lower, upper, solver)
    return replace(whole, time_us=whole.time_us + time_us)

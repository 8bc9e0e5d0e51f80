"""The optimum of a QP from a point that is nearly one: the rows that bind are known, the rest is linear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from himpc.qp import QPSolution

Array = NDArray[np.float64]

_NEAR = 1e-3
"""A point with a larger residual says nothing of which rows bind."""
_BINDS = 1e-9
"""A multiplier that is a smaller share of the largest one is what a solver left over; so is a row that is
beyond its bound by no more."""
_CHANGES = 30
"""How many rows may be taken or given back one by one."""


def polished(solution: QPSolution, c: Array, A: Array, low: Array, high: Array) -> QPSolution | None:
    """min ½‖x + c‖² subject to low ≤ A x ≤ high, A's rows of length one, from the rows that a solver's point
    says bind; None where it says nothing, or where these rows do not lead to the optimum."""
    multipliers = solution.multipliers
    if not (np.isfinite(multipliers).all() and solution.kkt_residual <= _NEAR):
        return None
    side = np.sign(multipliers) * (np.abs(multipliers) > _BINDS * np.abs(multipliers).max(initial=0.0))
    for _ in range(_CHANGES):
        held = np.flatnonzero(side)
        bound = np.where(side > 0, high, low)[held]
        if not np.isfinite(bound).all():
            return None
        rows = A[held]
        x = -c
        for _ in range(2):  # the second time takes away the first one's rounding
            x = x + np.linalg.lstsq(rows, bound - rows @ x)[0]
        pull = np.linalg.lstsq(rows.T, -c - x)[0]
        wrong = -side[held] * pull
        if held.size and wrong.max() > _BINDS * (1.0 + np.abs(pull).max()):
            side[held[wrong.argmax()]] = 0.0
            continue
        value = A @ x
        outside = np.maximum(low - value, value - high)
        outside[held] = 0.0
        if outside.max(initial=0.0) <= _BINDS:
            found = np.zeros(len(A))
            found[held] = pull
            return replace(solution, x=x, multipliers=found)
        row = int(outside.argmax())
        side[row] = 1.0 if value[row] > high[row] else -1.0
    return None

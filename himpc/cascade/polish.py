"""Refines the solution of min ½‖x + c‖² subject to low ≤ A x ≤ high with rows of length one, from an almost
optimal point or from any feasible point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from himpc.qp import QPSolution

Array = NDArray[np.float64]

_NEAR = 1e-3
"""A point with a larger residual does not show which rows are active."""
_LEFT = 1e-12
"""A multiplier below this share of the largest multiplier counts as an error of the solver."""
_BEYOND = 1e-9
"""A row with at most this violation counts as satisfied."""
_WRONG = 1e-12
"""A multiplier of the wrong sign below this share of the largest multiplier counts as zero."""
_ALONG = 1e-11
"""A row whose slope along the step is smaller than this share of the step's length is parallel to the step:
it is linearly dependent on the active rows."""
_STILL = 1e-9
"""A step below this share of the unconstrained optimum counts as zero."""
_CHANGES = 30
"""Largest number of rows that are added or removed one by one, in addition to the rows that a solver reported
as active."""


def polished(solution: QPSolution, c: Array, A: Array, low: Array, high: Array) -> QPSolution | None:
    """Computes the optimum from the rows that are active at a solver's point. Returns None if the point is
    too inaccurate, or if these rows and a few others do not lead to the optimum."""
    multipliers = solution.multipliers
    if not (np.isfinite(multipliers).all() and solution.kkt_residual <= _NEAR):
        return None
    side = np.sign(multipliers) * (np.abs(multipliers) > _LEFT * np.abs(multipliers).max(initial=0.0))
    for _ in range(_CHANGES):
        if not np.isfinite(np.where(side > 0, high, low)[side != 0]).all():
            return None
        x, pull = _held(side, c, A, low, high)
        wrong = -side * pull
        if wrong.max(initial=0.0) > _WRONG * np.abs(pull).max(initial=0.0):
            side[wrong.argmax()] = 0.0
            continue
        value = A @ x
        outside = np.where(side == 0, np.maximum(low - value, value - high), 0.0)
        if outside.max(initial=0.0) <= _BEYOND:
            return replace(solution, x=x, multipliers=np.where(wrong > 0, 0.0, pull))
        row = int(outside.argmax())
        side[row] = 1.0 if value[row] > high[row] else -1.0
    return None


def descended(solution: QPSolution, c: Array, A: Array, low: Array, high: Array) -> QPSolution | None:
    """Computes the optimum from x = 0 by the primal active-set method; returns None if x = 0 is not feasible.

    Below a level that uses nearly all freedom, the feasible set is almost a point. A solver that starts from
    an infeasible point then takes rounding errors for a contradiction. This method starts from a feasible
    point. A row that blocks a step is linearly independent of the active rows. After a step of length zero,
    the first row in order enters or leaves (Bland's rule). Therefore no active set occurs twice.
    """
    if not ((low <= 0.0) & (high >= 0.0)).all():
        return None
    x, side, stuck = np.zeros_like(c), np.zeros(len(A)), 0
    for _ in range(10 * len(A)):
        held = np.flatnonzero(side)
        way = -c - x
        way = way - np.linalg.lstsq(A[held], A[held] @ way)[0] if held.size else way
        far = np.abs(way).max(initial=0.0)
        rate = A @ way
        moving = (side == 0) & (np.abs(rate) > _ALONG * far) & (far > _STILL * (1.0 + np.abs(c).max()))
        room = np.full(len(A), np.inf)
        room[moving] = (np.where(rate > 0, high, low) - A @ x)[moving] / rate[moving]
        step = min(1.0, float(np.maximum(room, 0.0).min(initial=np.inf)))
        x = x + step * way
        stuck = 0 if step > 0.0 else stuck + 1
        if step < 1.0:
            row = int(np.flatnonzero(room <= step)[0] if stuck > len(A) else room.argmin())
            side[row] = np.sign(rate[row])
            continue
        x, pull = _held(side, c, A, low, high)
        wrong = -side * pull
        if wrong.max(initial=0.0) <= _WRONG * np.abs(pull).max(initial=0.0):
            return replace(solution, x=x, multipliers=np.where(wrong > 0, 0.0, pull), status="optimal")
        side[np.flatnonzero(wrong > 0)[0] if stuck > len(A) else wrong.argmax()] = 0.0
    return None


def _held(side: Array, c: Array, A: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Returns the optimum with rows held at their upper (side 1) or lower (−1) bounds, and all
    multipliers."""
    held, pull = np.flatnonzero(side), np.zeros(len(A))
    if not held.size:
        return -c, pull
    rows, bound = A[held], np.where(side > 0, high, low)[held]
    x = -c
    for _ in range(2):  # the second pass removes the rounding errors of the first
        x = x + np.linalg.lstsq(rows, bound - rows @ x)[0]
    pull[held] = np.linalg.lstsq(rows.T, -c - x)[0]
    return x, pull

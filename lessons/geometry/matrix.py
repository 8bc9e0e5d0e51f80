"""The Hessian of one level's QP as a picture, with the active rows of its solution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import LevelProblem, LevelSolution
from himpc.limits import Rows

LARGEST = 64
"""Largest number of rows and columns that are shown; for a larger Hessian, only the first knots that fit are
shown."""
DECADES = 6
"""Entries that are smaller than the largest by more than this number of powers of ten look like zero."""


@dataclass(frozen=True)
class ActiveRow:
    """An active bound: the joint (counted from 0), the knot of the first increment that it restricts, the
    limit, the side of the limit, and the size of the multiplier."""

    joint: int
    knot: int
    kind: str
    upper: bool
    multiplier: float


@dataclass(frozen=True, eq=False)
class Matrix:
    """A level's Hessian H = GᵀQG + R over the increments, knot by knot, joint by joint.

    Attributes:
        level: its name.
        joints, knots, shown: n, N, and the number of knots that are shown.
        shade: (k, k) int8; sign of the entry times 1 … 100, by its size on a logarithmic scale; 0 for entries
            that look like zero.
        largest: the largest entry's size, 1/(N·m)².
        condition: largest over smallest eigenvalue of the whole Hessian.
        active: active bounds of the level's solution, of all knots.
    """

    level: str
    joints: int
    knots: int
    shown: int
    shade: NDArray[np.int8]
    largest: float
    condition: float
    active: tuple[ActiveRow, ...]


def matrix(problem: LevelProblem, rows: Rows, solution: LevelSolution) -> Matrix:
    """Returns the picture of one level."""
    N, n = solution.U.shape
    H = problem.hessian
    shown = max(1, min(N, LARGEST // n))
    part = H[: shown * n, : shown * n]
    largest = float(np.abs(H).max())
    size = np.log10(np.maximum(np.abs(part) / largest, 10.0 ** -(DECADES + 1)))
    share = np.clip(1.0 + size / DECADES, 0.0, 1.0)
    values = np.linalg.eigvalsh(H)
    return Matrix(
        level=problem.name,
        joints=n,
        knots=N,
        shown=shown,
        shade=(np.sign(part) * np.ceil(100.0 * share)).astype(np.int8),
        largest=largest,
        condition=float(values[-1] / values[0]),
        active=tuple(_active(rows, solution, N)),
    )


def _active(rows: Rows, solution: LevelSolution, N: int) -> Sequence[ActiveRow]:
    active = solution.active
    return [
        ActiveRow(
            joint=joint,
            knot=int(row) % N,
            kind=rows.constraint(int(row), int(column), bool(multiplier > 0)).label,
            upper=bool(multiplier > 0),
            multiplier=abs(float(multiplier)),
        )
        for row, column, multiplier in zip(active.row, active.joint, active.multiplier, strict=True)
        for joint in rows.joints_of(int(row), int(column))
    ]

"""What a solved hierarchy must satisfy, and how far two solutions are apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from problems import Hierarchy, kkt_violation

from himpc.cascade.level import LevelSolution
from himpc.limits import Rows

Array = NDArray[np.float64]


def assert_sound(hierarchy: Hierarchy, solutions: list[LevelSolution], tolerance: float = 1e-6) -> None:
    """Every level solved its printed problem: KKT conditions, priorities and bounds."""
    above = np.zeros(hierarchy.shape)
    for level, solution in enumerate(solutions):
        assert solution.rung == "solve"
        assert solution.kkt_residual <= tolerance
        assert kkt_violation(hierarchy, level, solution, above) <= tolerance
        above = solution.U


def assert_within(rows: Rows, U: Array, tolerance: float = 1e-8) -> None:
    value = rows.L @ U
    assert (value <= rows.upper + tolerance).all()
    assert (value >= rows.lower - tolerance).all()


def assert_agree(one: list[LevelSolution], other: list[LevelSolution], tolerance: float = 1e-6) -> None:
    """Equal increments, level by level; once two points differ, the levels below solve different problems."""
    for a, b in zip(one, other, strict=True):
        difference = largest_difference([a], [b])
        assert difference <= tolerance
        if difference > 1e-9:
            break


def largest_difference(one: list[LevelSolution], other: list[LevelSolution]) -> float:
    return max(float(np.abs(a.U - b.U).max()) for a, b in zip(one, other, strict=True))

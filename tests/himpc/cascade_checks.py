"""Checks of a solved hierarchy, and the differences of two solutions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from problems import Hierarchy, kkt_violation

from benchmarks.exact import Exact, optimum
from himpc.cascade.level import NO_ROWS, LevelProblem, LevelSolution
from himpc.limits import Rows

Array = NDArray[np.float64]


def assert_sound(hierarchy: Hierarchy, solutions: list[LevelSolution], tolerance: float = 1e-6) -> None:
    """Checks that every level solved its printed problem: KKT conditions, priorities and bounds."""
    above = np.zeros(hierarchy.shape)
    for level, solution in enumerate(solutions):
        assert solution.fallback == "solve"
        assert solution.kkt_residual <= tolerance
        assert kkt_violation(hierarchy, level, solution, above) <= tolerance
        above = solution.U


def assert_within(rows: Rows, U: Array, tolerance: float = 1e-8) -> None:
    value = rows.L @ U
    assert (value <= rows.upper + tolerance).all()
    assert (value >= rows.lower - tolerance).all()


def torque_rows(hierarchy: Hierarchy) -> Rows:
    """Returns only the torque rows (32f)."""
    rows, (N, _) = hierarchy.rows, hierarchy.shape
    return Rows(rows.L[:N], rows.lower[:N], rows.upper[:N], rows.constraints[:1])


def assert_agree(one: list[LevelSolution], other: list[LevelSolution], tolerance: float = 1e-6) -> None:
    """Checks that the increments of two solutions are equal, level by level. If the points of a level differ
    slightly, the levels below it solve different problems and are not compared."""
    for a, b in zip(one, other, strict=True):
        difference = largest_difference([a], [b])
        assert difference <= tolerance
        if difference > 1e-9:
            break


def largest_difference(one: list[LevelSolution], other: list[LevelSolution]) -> float:
    return max(float(np.abs(a.U - b.U).max()) for a, b in zip(one, other, strict=True))


def exact_increments(hierarchy: Hierarchy, *guesses: list[LevelSolution]) -> list[Array]:
    """Returns the increments of every level, computed by `benchmarks.exact` with high precision. It finds the
    optimum from every guess that is nearly right, and the result does not depend on the guess."""
    above: list[tuple[LevelProblem, Exact]] = []
    for place, problem in enumerate(hierarchy.problems):
        found = None
        for active in (*(guess[place].active for guess in guesses), NO_ROWS):
            found = found or optimum(problem, hierarchy.rows, above, active)
        assert found is not None, f"no guess leads to the optimum of level {place + 1}"
        above.append((problem, found))
    return [exact.U for _, exact in above]


def off(solutions: list[LevelSolution], exact: list[Array]) -> float:
    """Returns the largest difference between solutions and the optima, N·m."""
    return max(float(np.abs(one.U - U).max()) for one, U in zip(solutions, exact, strict=True))

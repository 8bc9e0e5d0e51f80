"""QP solvers and a kernel that find no solution; the tests of the fallbacks use them."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from himpc import qp
from himpc.tick import fallbacks
from himpc.tick.kernel.arrays import AT, WHOLE_AT
from himpc.tick.kernel.control_period import LEVELS, LINEARIZE, NOT_FINITE, ONE_LEVEL

Array = NDArray[np.float64]

NONSENSE = {
    "garbage": lambda f, A: (np.full(f.size, 1e3), np.zeros(len(A)), "optimal"),
    "nan": lambda f, A: (np.full(f.size, np.nan), np.full(len(A), np.nan), "optimal"),
    "infinite": lambda f, A: (np.full(f.size, np.inf), np.zeros(len(A)), "optimal"),
    "unsolved": lambda f, A: (np.zeros(f.size), np.zeros(len(A)), "daqp -4"),
}


def break_solver(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """Makes every QP solver return an invalid point with the status of a solution."""

    def nonsense(problem: Any, _: object) -> tuple[Array, Array, str]:
        return NONSENSE[kind](problem.f, problem.A)

    monkeypatch.setattr(qp, "_ATTEMPTS", dict.fromkeys(get_args(qp.Solver), (nonsense,)))


def break_kernel(monkeypatch: pytest.MonkeyPatch, place: int | None = None) -> None:
    """Makes the kernel find no optimum, at one level or at all levels."""
    healthy = fallbacks.control_period

    def broken(*given: Any) -> int:
        *arena, parts, first, room = given
        data, where, whole, whole_where = arena
        count = whole[whole_where[WHOLE_AT["sizes"]] + 4]
        if parts & ONE_LEVEL:
            return healthy(*given) if place is not None and first != place else first
        if not parts & LEVELS:
            return healthy(*given)
        if parts & LINEARIZE and healthy(*arena, LINEARIZE, 0, 0.0) == NOT_FINITE:
            return NOT_FINITE
        for level in range(first, count):
            data[where[AT["U"]] + level * whole[whole_where[WHOLE_AT["sizes"]] + 8]] = np.nan
            if place is None or level == place or healthy(*arena, ONE_LEVEL, level, 0.0) == level:
                return level
            data[where[AT["fallback"]] + level] = 0.0
        return healthy(*arena, parts & ~(LINEARIZE | LEVELS), 0, room)

    monkeypatch.setattr(fallbacks, "control_period", broken)

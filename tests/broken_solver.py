"""QP solvers and a kernel that find no solution, for tests of the fallbacks."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from himpc import qp
from himpc.cascade import explicit
from himpc.tick import fallbacks, problems

Array = NDArray[np.float64]

NONSENSE = {
    "garbage": lambda f, A: (np.full(f.size, 1e3), np.zeros(len(A)), "optimal"),
    "nan": lambda f, A: (np.full(f.size, np.nan), np.full(len(A), np.nan), "optimal"),
    "infinite": lambda f, A: (np.full(f.size, np.inf), np.zeros(len(A)), "optimal"),
    "unsolved": lambda f, A: (np.zeros(f.size), np.zeros(len(A)), "daqp -4"),
}


def break_solver(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """Makes every QP solver return an invalid point with the status of a solution, and disables the method
    that starts from the point above."""

    def nonsense(H: Array, f: Array, A: Array, *_: Any, **__: Any) -> tuple[Array, Array, str]:
        return NONSENSE[kind](f, A)

    monkeypatch.setattr(qp, "_ATTEMPTS", dict.fromkeys(get_args(qp.Solver), (nonsense,)))
    monkeypatch.setattr(explicit, "descended", lambda *_: None)


def break_kernel(monkeypatch: pytest.MonkeyPatch, place: int | None = None) -> None:
    """Makes the kernel find no optimum, at one level or at all, and disables the printed QP."""
    healthy = fallbacks.solve_level

    def broken(*arguments: Any) -> bool:
        return arguments[4] != place and place is not None and healthy(*arguments)

    monkeypatch.setattr(fallbacks, "solve_level", broken)
    monkeypatch.setattr(fallbacks, "solve_explicit", lambda *_: None)
    monkeypatch.setattr(problems, "solve_level", broken)

"""Converts a level's problem in an arena to a `LevelProblem` of the printed route."""

from __future__ import annotations

import numpy as np

from himpc.cascade.level import LevelProblem
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.cascade import FIRST, KNOTS, LAST


def printed_problem(arena: Arena, place: int) -> LevelProblem:
    """Returns Problem i, (32) or (34), of an arena that `linearize` has filled."""
    f, i = arena.f, arena.i
    first, last, knots = (int(i["level"][place, column]) for column in (FIRST, LAST, KNOTS))
    rows, N = slice(first, last), f["free"].shape[0]
    lag = np.subtract.outer(np.arange(N), np.arange(N))
    weighted = np.where(lag[:, None] >= 0, f["C"][rows][:, np.maximum(lag, 0)].transpose(1, 0, 2), 0.0)
    counted = np.arange(N)[:, None] < i["row_knots"][rows]
    weighted *= counted[:, :, None]
    root_Q = f["root_Q"][rows].copy()
    free = np.where(counted, f["free"][:, rows], 0.0)
    R = f["rho"][place] / f["metric"][place] ** 2
    return LevelProblem(
        name=str(place),
        B=f["B"][:, rows].copy(),
        C=weighted / root_Q[:, None],
        free=free,
        weighted_free=root_Q * free,
        root_Q=root_Q,
        weighted_C=weighted[:knots, :, :knots],
        R=R,
        knots=knots,
        common_R=float(R[0]) if (R[0] == R).all() else None,
    )

"""Converts solved levels to evidence: the errors reached and the active constraints."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.kernel.kinds import COLLISION, LEXICOGRAPHIC
from himpc.htmpc.plan import ActiveMotionRows, LevelEvidence
from himpc.htmpc.problem import Iterate
from himpc.htmpc.rows import ConstraintRows
from himpc.htmpc.sqp import Solved
from himpc.htmpc.tracking import Tracking

Array = NDArray[np.float64]

_ROUNDING = 1e-6
"""A multiplier whose magnitude is smaller than this is a rounding error."""


def evidence(
    level: Tracking,
    solved: Solved,
    final: Iterate,
    guards: Sequence[str],
    named: Callable[[int], str] | None = None,
) -> LevelEvidence:
    """Builds the evidence of a level from the result of `solve_level`.

    Args:
        final: the inputs after all levels.
        guards: the names of the rows of (12) or (11), in their order.
        named: returns the names of a pair, see `CollisionModel.named`.
    """
    best = solved.at.errors(level)
    return LevelEvidence(
        name=level.name,
        status=solved.status,
        fallback=solved.fallback,
        kkt_residual=solved.kkt_residual,
        best=best,
        final=final.errors(level),
        cost=level.cost(best),
        steps=solved.steps,
        iterations=len(solved.steps),
        unsolved=solved.unsolved,
        time_us=solved.time_us,
        active=_active_rows(solved.rows, solved.multipliers, guards, named),
    )


def _active_rows(
    rows: ConstraintRows, multipliers: Array, guards: Sequence[str], named: Callable[[int], str] | None
) -> ActiveMotionRows:
    """Returns the active rows. The bounds of the slacks, whose multipliers are the last ones, are left
    out."""
    multipliers = multipliers[: len(rows.kind)]
    some = np.flatnonzero(np.abs(multipliers) > _ROUNDING)
    kind, part = rows.kind[some], rows.part[some]
    of_guards = dict(zip(np.flatnonzero(rows.kind == LEXICOGRAPHIC).tolist(), guards, strict=True))
    names = tuple(
        named(pair) if is_pair and named else of_guards.get(row, "")
        for row, is_pair, pair in zip(some.tolist(), (kind == COLLISION).tolist(), part.tolist(), strict=True)
    )
    return ActiveMotionRows(kind, rows.knot[some], part, multipliers[some], names)

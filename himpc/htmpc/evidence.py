"""From solved levels to evidence: what was reached, and what binds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.kernel.rows import LEXICOGRAPHIC
from himpc.htmpc.plan import LevelEvidence
from himpc.htmpc.problem import Iterate
from himpc.htmpc.rows import KINDS, Rows
from himpc.htmpc.sqp import Solved
from himpc.htmpc.tracking import Tracking
from himpc.plan import Binding

Array = NDArray[np.float64]

_FELT = 1e-6
"""Smaller multipliers are rounding."""


def evidence(level: Tracking, solved: Solved, final: Iterate, joints: tuple[str, ...]) -> LevelEvidence:
    """What `solve_level` found for a level; `final` holds the inputs after all levels."""
    best = solved.at.errors(level)
    return LevelEvidence(
        name=level.name,
        status=solved.status,
        rung=solved.rung,
        kkt_residual=solved.kkt_residual,
        best=best,
        final=final.errors(level),
        cost=level.cost(best),
        steps=solved.steps,
        iterations=len(solved.steps),
        unsolved=solved.unsolved,
        time_us=solved.time_us,
        binding=_binding(level.name, solved.rows, solved.multipliers, joints),
    )


def _binding(name: str, rows: Rows, multipliers: Array, joints: tuple[str, ...]) -> tuple[Binding, ...]:
    multipliers = multipliers[: len(rows.kind)]
    felt = np.flatnonzero(np.abs(multipliers) > _FELT)
    each = zip(
        *(values[felt].tolist() for values in (rows.kind, rows.knot, rows.part, multipliers)), strict=True
    )
    found: list[Binding] = []
    for kind, knot, part, multiplier in each:
        joint = joints[part] if kind < LEXICOGRAPHIC else f"{KINDS[kind]} {part}"
        side = "upper" if multiplier > 0 else "lower"
        found.append(Binding(name, joint, KINDS[kind], side, knot, abs(multiplier), 0.0))
    return tuple(found)

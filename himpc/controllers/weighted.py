"""A controller with all tasks in one weighted cost, for comparison with strict priorities."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import LevelProblem
from himpc.controllers.himpc import HIMPC
from himpc.formulation.forms import LevelForm, Prepared
from himpc.formulation.settings import Settings
from himpc.limits import Rows
from himpc.stack import DAMPING_LEVEL
from himpc.tick.problems import increments_of
from himpc.tick.tick import CompiledTick

Array = NDArray[np.float64]

DAMPING_SHARE = 1e-4
"""Factor on the damping level's Q: the level must damp directions that no task uses, without competing with
the tasks."""


class Weighted(HIMPC):
    """HIMPC without priorities: min Σ_i V_i over one U under the same rows; V_i is the cost (32a) of level i.

    Model, weights, bounds and memory are the same as in HIMPC, but (33) is missing: the importance of a level
    is its Q, and the order of the levels has no effect. A level's own horizon (Remark 8) limits its residual,
    but not its effort: R of (31) is the sum over all levels, up to the longest horizon.

    Evidence: entry p of the plan is the solution of the same problem with levels 1 … p alone; the last entry
    is applied. As for HIMPC, the leak of an entry is computed from the differences between this entry and the
    entries p above it. `cost` is V_p under the applied U. `step_us` does not include the r − 1 QPs that only
    the evidence needs.
    """

    def _compile(self, settings: Settings, prepared: Prepared) -> CompiledTick:
        return CompiledTick(self.robot, settings, prepared, alone=True)

    def _apply(self, settings: Settings) -> None:
        super()._apply(settings)
        for index, level in enumerate(self._form.levels):
            if level.name == DAMPING_LEVEL.name:
                self.kernel.fade(index, math.sqrt(DAMPING_SHARE))

    def _faded(self, level: LevelForm) -> float | Array:
        share = super()._faded(level)
        return math.sqrt(DAMPING_SHARE) * share if level.name == DAMPING_LEVEL.name else share


def sum_of_costs(problems: Sequence[LevelProblem]) -> LevelProblem:
    """Returns one problem whose cost is the sum of the problems' costs, with the name of the last problem."""

    def within(rows: Array, own: int) -> Array:
        seen = np.arange(len(rows)).reshape(-1, *[1] * (rows.ndim - 1)) < own
        return np.where(seen, rows, 0.0)

    return LevelProblem(
        name=problems[-1].name,
        B=np.concatenate([problem.B for problem in problems], axis=1),
        C=np.concatenate([within(problem.C, problem.knots) for problem in problems], axis=1),
        free=np.concatenate([within(problem.free, problem.knots) for problem in problems], axis=1),
        root_Q=np.concatenate([problem.root_Q for problem in problems]),
        R=np.sum([problem.R for problem in problems], axis=0),
        knots=max(problem.knots for problem in problems),
    )


def compromise(problems: Sequence[LevelProblem], rows: Rows) -> Array | None:
    """Returns the increments U (N, n), N·m, that this controller chooses in a tick of HIMPC; None if it finds
    no solution."""
    share = math.sqrt(DAMPING_SHARE)
    calmed = [
        problem._replace(root_Q=share * problem.root_Q) if problem.name == DAMPING_LEVEL.name else problem
        for problem in problems
    ]
    return increments_of(sum_of_costs(calmed), rows)

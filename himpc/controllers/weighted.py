"""A controller with all tasks in one weighted cost, for comparison with strict priorities."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import LevelProblem, LevelSolution
from himpc.controllers.himpc import HIMPC
from himpc.controllers.period import PeriodState
from himpc.formulation.forms import LevelForm, Prepared
from himpc.formulation.settings import Settings
from himpc.limits import Rows
from himpc.plan import Plan
from himpc.references import Preview
from himpc.stack import DAMPING_LEVEL
from himpc.tick.problems import increments_of
from himpc.tick.tables import LevelTable
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

    _evidence_us = 0.0

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """Computes one control period, see `HIMPC.step`."""
        self._evidence_us = 0.0
        plan = super().step(q, v, previews, tau_applied)
        return replace(plan, step_us=plan.step_us - self._evidence_us) if self._evidence_us else plan

    def _compile(self, settings: Settings, prepared: Prepared) -> CompiledTick:
        form, idle, off = prepared
        levels = [] if idle else list(accumulated(form.levels))
        tick = CompiledTick(self.robot, settings, form, off, levels)
        for place, level in enumerate(form.levels):
            if level.name == DAMPING_LEVEL.name:
                tick.fade(place, math.sqrt(DAMPING_SHARE))
        return tick

    def _faded(self, level: LevelForm) -> float | Array:
        share = super()._faded(level)
        compiled = self.kernel is not None and level.name == DAMPING_LEVEL.name
        return math.sqrt(DAMPING_SHARE) * share if compiled else share

    def _cascade(self, problems: list[LevelProblem], tick: PeriodState) -> list[LevelSolution]:
        problems = _calmed(problems)

        def solve(count: int) -> LevelSolution:
            return super(Weighted, self)._cascade([sum_of_costs(problems[:count])], tick)[0]

        applied = solve(len(problems))
        started = perf_counter_ns()
        found = [*(solve(count) for count in range(1, len(problems))), applied]
        increments = [solution.U for solution in found]
        solutions = [
            solution._replace(
                name=problem.name,
                cost=problem.cost(applied.U),
                leak=_leak(problems[:place], increments, place),
            )
            for place, (problem, solution) in enumerate(zip(problems, found, strict=True))
        ]
        self._evidence_us = (perf_counter_ns() - started) / 1e3
        return solutions


def accumulated(levels: Sequence[LevelForm]) -> Iterator[LevelTable]:
    """Returns, for every p, the problem whose cost is the sum over levels 1 … p. Its evidence is that of
    level p."""
    R, knots = np.zeros_like(levels[0].R), 0
    for level in levels:
        R, knots = R + level.R, max(knots, level.knots)
        yield LevelTable(slice(0, level.rows.stop), knots, R, level.rows, level.knots, level.R, alone=True)


def sum_of_costs(problems: Sequence[LevelProblem]) -> LevelProblem:
    """Returns one problem whose cost is the sum of the problems' costs, with the name of the last problem."""
    knots = max(problem.knots for problem in problems)
    N = len(problems[0].B)
    weighted_C = []
    for problem in problems:
        block = np.zeros((knots, problem.B.shape[1], knots))
        block[: problem.knots, :, : problem.knots] = problem.weighted_C
        weighted_C.append(block)

    def within(rows: Array, own: int) -> Array:
        return rows if own == N else np.where(_before(own, rows), rows, 0.0)

    common = [problem.common_R for problem in problems]
    return LevelProblem(
        name=problems[-1].name,
        B=np.concatenate([problem.B for problem in problems], axis=1),
        C=np.concatenate([within(problem.C, problem.knots) for problem in problems], axis=1),
        free=np.concatenate([within(problem.free, problem.knots) for problem in problems], axis=1),
        weighted_free=np.concatenate(
            [within(problem.weighted_free, problem.knots) for problem in problems], axis=1
        ),
        root_Q=np.concatenate([problem.root_Q for problem in problems]),
        weighted_C=np.concatenate(weighted_C, axis=1),
        R=np.sum([problem.R for problem in problems], axis=0),
        knots=knots,
        common_R=None if None in common else sum(each for each in common if each is not None),
    )


def compromise(problems: Sequence[LevelProblem], rows: Rows) -> Array | None:
    """Returns the increments U (N, n), N·m, that this controller chooses in a tick of HIMPC; None if it finds
    no solution."""
    return increments_of(sum_of_costs(_calmed(problems)), rows)


def _before(own: int, rows: Array) -> NDArray[np.bool_]:
    return np.arange(len(rows)).reshape(-1, *[1] * (rows.ndim - 1)) < own


def _calmed(problems: Sequence[LevelProblem]) -> list[LevelProblem]:
    return [_softened(each) if each.name == DAMPING_LEVEL.name else each for each in problems]


def _softened(problem: LevelProblem) -> LevelProblem:
    share = math.sqrt(DAMPING_SHARE)
    return problem._replace(
        root_Q=share * problem.root_Q,
        weighted_free=share * problem.weighted_free,
        weighted_C=share * problem.weighted_C,
    )


def _leak(above: Sequence[LevelProblem], increments: Sequence[Array], place: int) -> float:
    """Returns the largest ‖J_p M̄⁻¹(Δτ_i − Δτ_p)‖∞ over all knots and all levels p above level i."""
    effects = (problem.B @ (increments[place] - increments[p])[:, :, None] for p, problem in enumerate(above))
    return max((float(np.abs(effect).max()) for effect in effects), default=0.0)

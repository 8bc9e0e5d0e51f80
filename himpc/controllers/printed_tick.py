"""One control period by the printed equations: the inputs of `himpc.printed` from a controller, the fallbacks
of its levels, and the plan with its evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from himpc import printed
from himpc.cascade.last_resort import containing, last_resort, softened
from himpc.cascade.level import NO_ROWS, ActiveRows, Fallback, LevelProblem, LevelSolution
from himpc.controllers.viewer import Viewer
from himpc.formulation.forms import Prepared, usable
from himpc.formulation.memory import Memory
from himpc.formulation.settings import Settings
from himpc.limits import LimitsInForce, Rows, build_rows
from himpc.plan import Evidence, Plan
from himpc.printed import Optimum
from himpc.qp import Solver
from himpc.references import Preview
from himpc.tick.distances import Distances
from robots import Robot

Array = NDArray[np.float64]

_BINDING = 1e-9
"""A row is active if its multiplier exceeds _BINDING, and its distance from its bound is below
1000 · _BINDING, N·m."""


class PrintedTick:
    """The printed counterpart of `himpc.tick.tick.CompiledTick`, with the same methods."""

    def __init__(self, robot: Robot, settings: Settings, prepared: Prepared) -> None:
        """Raises InputError if the settings do not fit the robot."""
        self._viewer = Viewer(robot, settings, prepared)
        self._progress = np.zeros(len(prepared.form.tasks)), 0.0
        self._predicted: Array | None = None
        self._solutions: dict[str, LevelSolution] = {}
        self.change(settings, prepared)

    def change(self, settings: Settings, prepared: Prepared) -> None:
        """Takes the numbers of settings of the same structure, see `same_structure`."""
        self._settings, self._form = settings, prepared.form
        self._viewer.change(settings, prepared.form)
        self._M_bar, self._pull = np.array(settings.M_bar), settings.limits.avoidance.largest_error
        self._shares: list[float | Array] = [1.0] * len(prepared.form.levels)
        self._problems: list[LevelProblem] = []

    @property
    def memory(self) -> Memory | None:
        """The memory, from which another controller can continue."""
        before = self._viewer.memory
        return before and before._replace(predicted_q=self._predicted, solutions=self._solutions)

    def recall(self, memory: Memory, q: Array, v: Array) -> None:
        """Continues from the memory of another controller."""
        self._viewer.memory = memory
        self._predicted, self._solutions = memory.predicted_q, dict(memory.solutions)

    def forget(self) -> None:
        """Clears the memory."""
        self._viewer.forget()
        self._predicted, self._solutions, self._problems = None, {}, []

    @property
    def distances(self) -> Distances | None:
        """The pairs whose distances are kept; None if none are."""
        return self._viewer.distances

    def progress(self) -> tuple[Array, float]:
        """See `CompiledTick.progress`."""
        return self._progress

    def pull(self, largest_error: float) -> None:
        """Sets the largest error on which tasks act, m or rad."""
        self._pull = largest_error

    def fade(self, index: int, share: float | Array) -> None:
        """Multiplies a level's √Q by `share`, one number or one per row."""
        self._shares[index] = share

    def take_M_bar(self, M_bar: Array) -> None:
        """Sets the diagonal of M̄, (n,) kg·m²."""
        self._M_bar = M_bar

    def problems(self) -> list[LevelProblem]:
        """Returns the problems of the last tick; none before the first one."""
        return self._problems

    def step(
        self,
        q: Array,
        v: Array,
        previews: Mapping[str, Preview],
        tau_0: Array,
        limits: LimitsInForce,
        started: int,
    ) -> Plan | None:
        """Computes one control period, see `CompiledTick.step`."""
        settings, form, M_bar = self._settings, self._form, self._M_bar
        N, T_s = settings.horizon, settings.T_s
        before = self._solutions
        with np.errstate(all="ignore"):
            path = printed.knots(self._predicted, q, v, N, T_s)
            now, values, errors = self._viewer.at(q, v, tau_0, M_bar, limits, previews, path)
            pulled = np.concatenate([errors[task.name] for task in form.tasks])
            pulled = form.pulling(pulled, self._pull) if math.isfinite(self._pull) else pulled
            levels = [
                replace(level, error=pulled[prepared.rows], Q=level.Q * share**2)
                for level, prepared, share in zip(now.levels, form.levels, self._shares, strict=False)
            ]
            problems = [printed.problem(now, level, path) for level in levels]
            if not all(
                math.isfinite(float(problem.free.sum()) + float(problem.B.sum())) for problem in problems
            ):
                return None
            moment = self._viewer.now
            rows = build_rows(moment.state, tau_0, M_bar, settings.limits, limits, N, T_s, moment.near)
            A, lower, upper = printed.bounds(now)
            rows = rows._replace(lower=lower.reshape(rows.lower.shape), upper=upper.reshape(rows.upper.shape))
            solutions = solve(problems, A, rows, before, settings.solver)
        U = solutions[-1].U if solutions else np.zeros((N, q.size))
        tau = np.minimum(np.maximum(tau_0 + U[0], limits.tau_lower), limits.tau_upper)
        if not usable(tau):
            return None
        self._problems, self._progress = problems, (form.lengths(errors), form.fastest(previews))
        self._predicted = printed.predict(q, v, now.q_ddot, U, M_bar, T_s)
        self._solutions = {solution.name: solution for solution in solutions}
        evidence = Evidence(tuple(solutions), self._predicted, errors, values, rows)
        return Plan(
            tau=tau,
            tau_0=tau_0,
            limits=limits,
            step_us=(perf_counter_ns() - started) / 1e3,
            unsolved=sum(solution.fallback != "solve" for solution in solutions),
            find_evidence=lambda: evidence,
            M_bar=M_bar if settings.M_bar_adapt else None,
        )


def solve(
    problems: Sequence[LevelProblem],
    A: Array,
    rows: Rows,
    previous: Mapping[str, LevelSolution],
    solver: Solver = "daqp",
) -> list[LevelSolution]:
    """Solves Problem 1 to Problem r by `himpc.printed.cascade`, with a fallback for every level without an
    optimum.

    Level 1 has four fallbacks, which are tried in this order. "solve" solves the printed problem. "soften"
    widens the state rows by the least slack that makes them feasible; the lower levels then use the widened
    rows, as Theorem 2 requires. "previous" is this level's plan of the last tick, shifted by one tick; it is
    used if that plan was an optimum and the shifted plan meets all rows. "brake" brings the joints to rest as
    far as the rows allow. A lower level has "solve" and "inherit", which uses the increments of the level
    above. So the increments meet all rows whenever such increments exist.

    Args:
        problems: the levels, highest priority first.
        A: the matrix of the rows, see `Rows.matrix`.
        rows: all bounds of this tick.
        previous: last tick's solutions by level name.
        solver: QP solver.
    """
    if not problems:
        return []
    N, _, n = problems[0].B.shape
    times = [perf_counter_ns()]

    def cascade(rows: Rows, upto: int, U: Array, first: int = 0) -> list[Optimum]:
        return printed.cascade(problems[:upto], A, rows.lower.ravel(), rows.upper.ravel(), U, first, solver)

    still = np.zeros((N, n))
    best = cascade(rows, 1, still)[0]
    fallback: Fallback = "solve"
    widened = None if best.solved else softened(rows)
    if widened is not None:
        best, rows = cascade(widened, 1, still)[0], widened
        fallback = "soften"
    if not best.solved:
        before = previous.get(problems[0].name)
        optimal = before is not None and before.fallback in ("solve", "soften")
        fallback, held = last_resort(rows, before.U if before is not None and optimal else None)
        best, rows = Optimum(held, np.zeros(len(A)), 0.0, "unsolved", best.qp_us), containing(rows, held)
    times.append(perf_counter_ns())
    optima = [best]
    for i in range(1, len(problems)):
        optima.append(cascade(rows, i + 1, optima[-1].U, i)[0])
        times.append(perf_counter_ns())
    return [
        LevelSolution(
            name=problem.name,
            U=optimum.U,
            cost=problem.cost(optimum.U),
            active=_active(optimum, rows),
            kkt_residual=optimum.residual,
            status=optimum.status,
            fallback="solve" if optimum.solved and i else "inherit" if i else fallback,
            time_us=(times[i + 1] - times[i]) / 1e3,
            qp_us=optimum.qp_us,
            leak=max((_change(problems[p].B, optimum.U - optima[p].U) for p in range(i)), default=0.0),
        )
        for i, (problem, optimum) in enumerate(zip(problems, optima, strict=True))
    ]


def _change(B: Array, U: Array) -> float:
    """Returns ‖J M̄⁻¹ Δτ‖∞ over all knots."""
    return float(np.abs(B @ U[:, :, None]).max(initial=0.0))


def _active(optimum: Optimum, rows: Rows) -> ActiveRows:
    multipliers, value = optimum.multipliers.reshape(rows.lower.shape), rows.values(optimum.U)
    slack = np.where(multipliers > 0, rows.upper - value, value - rows.lower)
    # Some solvers leave tiny multipliers at all rows.
    row, column = np.nonzero((np.abs(multipliers) > _BINDING) & (slack < 1e3 * _BINDING))
    return ActiveRows(row, column, multipliers[row, column], slack[row, column]) if row.size else NO_ROWS

"""From Problem 1 to Problem r, with a fallback for every level that cannot be solved."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import accumulate, pairwise
from time import perf_counter_ns
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.explicit import solve_explicit
from himpc.cascade.level import NO_ROWS, ActiveRows, LevelProblem, LevelSolution, Point, Rung
from himpc.cascade.null_space import nested_bases
from himpc.cascade.structured import solve_structured
from himpc.cascade.triangular import solve_triangular
from himpc.limits.rows import Rows, least_slack
from himpc.qp import Solver

Array = NDArray[np.float64]
Route = Literal["structured", "explicit"]
ROUTES: tuple[Route, ...] = ("structured", "explicit")
RUNGS: tuple[Rung, ...] = ("solve", "soften", "previous", "inherit", "damping", "hold")

_ROOM = 1e-7
"""N·m added to the least slack, so that the widened rows have an interior to rounding."""


def solve_cascade(
    problems: Sequence[LevelProblem],
    rows: Rows,
    previous: Mapping[str, LevelSolution],
    damping: Callable[[], LevelProblem],
    route: Route,
    solver: Solver,
) -> list[LevelSolution]:
    """Solves the levels in order; each keeps what (33) asks of the levels above.

    The ladder, each rung counted by the caller: "solve" the printed problem; "soften" the state rows by the
    least slack that makes them feasible, and pass the widened rows down (else Theorem 2 breaks);
    level 1 then falls to the shifted "previous" plan of that level if it meets the torque rows, or to the
    "damping" level alone under torque rows; a lower level "inherit"s U_{i−1}, which keeps every priority.

    Args:
        problems: the levels, highest priority first; at least one.
        rows: all bounds of this tick.
        previous: last tick's solutions by level name: warm starts and the "previous" rung.
        damping: makes the damping problem for the last rung, which is hardly ever needed.
        route: structured or explicit.
        solver: QP solver.
    """
    N, _, n = problems[0].B.shape
    warm = [_fitting(previous.get(problem.name), rows) for problem in problems]
    upper = [problem.B for problem in problems[:-1]]
    B = np.concatenate(upper, axis=1) if len(upper) > 1 else upper[0] if upper else np.empty((N, 0, n))
    points = solve_triangular(problems, B, rows, warm) if route == "structured" else []
    rungs: list[Rung] = ["solve"] * len(points)
    if len(points) < len(problems):
        U = points[-1].U if points else np.zeros((N, n))
        above = [(problem.B, point.U) for problem, point in zip(problems, points, strict=False)]
        bases = [_whole_space(N, n), *nested_bases(upper)]
        for place in range(len(points), len(problems)):
            started = perf_counter_ns()
            problem, Z = problems[place], bases[place]
            if Z.shape[2] == 0:
                point, rung = Point(U, NO_ROWS, 0.0, "empty"), "solve"
            else:
                before = previous.get(problem.name)
                point, rung, rows = _climb_down(
                    problem, rows, U, above, Z, warm[place], before, damping, route, solver
                )
            U = point.U
            above.append((problem.B, U))
            points.append(point._replace(time_us=(perf_counter_ns() - started) / 1e3))
            rungs.append(rung)
    leaks = _leaks(upper, B, [point.U for point in points])
    return [
        LevelSolution(
            problem.name,
            point.U,
            problem.cost(point.U, point.error),
            point.active,
            point.kkt_residual,
            point.status,
            rung,
            point.time_us,
            point.qp_us,
            leak,
        )
        for problem, point, rung, leak in zip(problems, points, rungs, leaks, strict=True)
    ]


@lru_cache(maxsize=8)
def _whole_space(N: int, n: int) -> Array:
    return np.tile(np.eye(n), (N, 1, 1))


def _fitting(before: LevelSolution | None, rows: Rows) -> ActiveRows:
    """Last tick's active rows, if the horizon and the kinds of rows are still the same."""
    if before is None or not before.active.row.size:
        return NO_ROWS
    return before.active if before.active.row.max() < len(rows.L) else NO_ROWS


def _climb_down(
    problem: LevelProblem,
    rows: Rows,
    U: Array,
    above: list[tuple[Array, Array]],
    Z: Array,
    warm: ActiveRows,
    before: LevelSolution | None,
    damping: Callable[[], LevelProblem],
    route: Route,
    solver: Solver,
) -> tuple[Point, Rung, Rows]:
    def attempt(problem: LevelProblem, rows: Rows, warm: ActiveRows = NO_ROWS) -> Point | None:
        if route == "explicit":
            return solve_explicit(problem, rows, U, above, Z, solver)
        return solve_structured(problem, rows, U if above else None, Z, warm, solver)

    point = attempt(problem, rows, warm)
    if point is not None:
        return point, "solve", rows
    if above:
        return Point(U, NO_ROWS, 0.0, "unsolved"), "inherit", rows
    slack = least_slack(rows)
    widened = rows.widened(np.where(slack > 0, slack + _ROOM, 0.0))
    point = attempt(problem, widened) if slack.any() else None
    if point is not None:
        return point, "soften", widened
    torque = rows.torque_only()
    if before is not None and before.U.shape == U.shape:
        shifted = np.vstack([before.U[1:], np.zeros((1, U.shape[1]))])
        value = torque.L @ shifted
        if ((value >= torque.lower) & (value <= torque.upper)).all():
            return Point(shifted, NO_ROWS, 0.0, "unsolved"), "previous", _containing(rows, shifted)
    point = attempt(damping(), torque)
    if point is not None:
        return point._replace(kkt_residual=0.0, status="unsolved"), "damping", _containing(rows, point.U)
    first = np.clip(np.zeros(U.shape[1]), torque.lower[0], torque.upper[0])
    held = np.vstack([first, np.zeros((len(U) - 1, U.shape[1]))])
    return Point(held, NO_ROWS, 0.0, "unsolved"), "hold", _containing(rows, held)


def _containing(rows: Rows, U: Array) -> Rows:
    """The rows widened as far as U needs: lower levels then start from a feasible point."""
    value = rows.L @ U
    return rows._replace(lower=np.minimum(rows.lower, value), upper=np.maximum(rows.upper, value))


def _leaks(upper: Sequence[Array], B: Array, increments: Sequence[Array]) -> list[float]:
    """‖J_p M̄⁻¹(Δτ_i − Δτ_p)‖∞ over knots and levels p above, for every level i.

    Args:
        upper: B_p of all levels but the last.
        B: the same, one below the other.
        increments: U_i of all levels, (N, n) each.
    """
    if not upper:
        return [0.0]
    effect = np.matmul(B, np.array(increments)[..., None])[..., 0]
    own = np.empty(effect.shape[1:])
    ends = [0, *accumulate(block.shape[1] for block in upper)]
    for place, (start, end) in enumerate(pairwise(ends)):
        own[:, start:end] = effect[place, :, start:end]
    change = np.abs(effect[1:] - own)
    return [0.0, *(float(change[i, :, :end].max()) for i, end in enumerate(ends[1:]))]

"""Solves Problem 1 to Problem r, with a fallback for every level that cannot be solved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate, pairwise
from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.explicit import solve_explicit
from himpc.cascade.last_resort import containing, last_resort, softened
from himpc.cascade.level import NO_ROWS, Fallback, LevelProblem, LevelSolution, Point
from himpc.cascade.null_space import nested_bases, whole_space
from himpc.limits.rows import Rows
from himpc.qp import Solver

Array = NDArray[np.float64]


def solve_cascade(
    problems: Sequence[LevelProblem],
    rows: Rows,
    previous: Mapping[str, LevelSolution],
    solver: Solver,
) -> list[LevelSolution]:
    """Solves the levels in order; each level satisfies the priority constraints (33) of the levels above.

    Level 1 has four fallbacks, which are tried in this order. "solve" solves the printed problem. "soften"
    widens the state rows by the least slack that makes them feasible; the lower levels then use the widened
    rows, as Theorem 2 requires. "previous" is this level's plan of the last tick, shifted by one tick; it is
    used if that plan was an optimum and the shifted plan meets all rows. "brake" brings the joints to rest as
    far as the rows allow.

    A lower level has two fallbacks: "solve", and "inherit", which uses U_{i−1}, the increments of the level
    above. "inherit" keeps every priority.

    So the increments meet all rows whenever such increments exist.

    Args:
        problems: the levels, highest priority first; at least one.
        rows: all bounds of this tick.
        previous: last tick's solutions by level name, for the "previous" fallback.
        solver: QP solver.
    """
    N, _, n = problems[0].B.shape
    upper = [problem.B for problem in problems[:-1]]
    U, above = np.zeros((N, n)), []
    points: list[Point] = []
    fallbacks: list[Fallback] = []
    for problem, Z in zip(problems, [whole_space(N, n), *nested_bases(upper)], strict=True):
        started = perf_counter_ns()
        if Z.shape[2] == 0:
            point, fallback = Point(U, NO_ROWS, 0.0, "empty"), "solve"
        else:
            before = previous.get(problem.name)
            point, fallback, rows = _climb_down(problem, rows, U, above, Z, before, solver)
        U = point.U
        above.append((problem.B, U))
        points.append(point._replace(time_us=(perf_counter_ns() - started) / 1e3))
        fallbacks.append(fallback)
    B = np.concatenate([np.empty((N, 0, n)), *upper], axis=1)
    leaks = _leaks(upper, B, [point.U for point in points])
    return [
        LevelSolution(
            problem.name,
            point.U,
            problem.cost(point.U, point.error),
            point.active,
            point.kkt_residual,
            point.status,
            fallback,
            point.time_us,
            point.qp_us,
            leak,
        )
        for problem, point, fallback, leak in zip(problems, points, fallbacks, leaks, strict=True)
    ]


def _climb_down(
    problem: LevelProblem,
    rows: Rows,
    U: Array,
    above: list[tuple[Array, Array]],
    Z: Array,
    before: LevelSolution | None,
    solver: Solver,
) -> tuple[Point, Fallback, Rows]:
    point = solve_explicit(problem, rows, U, above, Z, solver)
    if point is not None:
        return point, "solve", rows
    if above:
        return Point(U, NO_ROWS, 0.0, "unsolved"), "inherit", rows
    widened = softened(rows)
    point = None if widened is None else solve_explicit(problem, widened, U, above, Z, solver)
    if widened is not None and point is not None:
        return point, "soften", widened

    optimal = before is not None and before.fallback in ("solve", "soften")
    fallback, held = last_resort(widened or rows, before.U if before is not None and optimal else None)
    return Point(held, NO_ROWS, 0.0, "unsolved"), fallback, containing(rows, held)


def _leaks(upper: Sequence[Array], B: Array, increments: Sequence[Array]) -> list[float]:
    """Returns, for every level i, the largest ‖J_p M̄⁻¹(Δτ_i − Δτ_p)‖∞ over all knots and all levels p above
    i.

    Args:
        upper: B_p of all levels but the last.
        B: these matrices, stacked.
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

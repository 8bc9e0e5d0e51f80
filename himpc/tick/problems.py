"""The compiled cascade for given level problems, without a controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from himpc.cascade.level import FALLBACKS, NO_ROWS, ActiveRows, Fallback, LevelProblem, LevelSolution
from himpc.limits.rows import Rows
from himpc.tick.fallbacks import perform, solve_level
from himpc.tick.kernel.arena import Arena, Snapshot
from himpc.tick.kernel.arrays import PULL, Array
from himpc.tick.kernel.control_period import FINISH, LEVELS
from himpc.tick.tables import budget_of, python_constraints, sizes, write_effects, write_levels


def solve_problems(
    problems: Sequence[LevelProblem],
    rows: Rows,
    previous: Mapping[str, LevelSolution],
) -> list[LevelSolution]:
    """Solves a cascade by the kernel. previous: the solutions of the last tick by the name of the level."""
    arena = arena_of(problems, rows, previous)
    perform(arena, LEVELS + FINISH, rows)
    return solutions([problem.name for problem in problems], arena.snapshot())


def arena_of(problems: Sequence[LevelProblem], rows: Rows, previous: Mapping[str, LevelSolution]) -> Arena:
    """Creates an arena and writes the problems into it."""
    N, _, n = problems[0].B.shape
    ends = np.cumsum([0] + [problem.B.shape[1] for problem in problems])
    constraints = python_constraints(rows.constraints)
    arena = sizes(n, N, int(ends[-1]), int(ends[-1]), len(problems), len(rows.L), directed=len(constraints))
    f = arena.f
    tables = []
    for index, problem in enumerate(problems):
        span = slice(int(ends[index]), int(ends[index + 1]))
        f["B"][:, span], f["free"][:, span] = problem.B, problem.free
        write_effects(arena, span, problem.root_Q, problem.C, problem.knots)
        tables.append((span, problem.knots, problem.R))
        before = previous.get(problem.name)
        if before is not None:
            write_warm_start(arena, index, before.active)
            if before.U.shape == (N, n):
                f["U_was"][index], arena.i["known"][1] = before.U, 1
    write_levels(arena, tables)
    f["L"][:], f["lower"][:], f["upper"][:] = rows.L, rows.lower, rows.upper
    f["direction"][:] = np.eye(n)
    for index, directions in enumerate(rows.directions[len(rows.constraints) - len(constraints) :]):
        if directions is not None:
            f["direction"][index] = directions.D
    arena.i["bit"][:] = rows.bits
    f["M_bar"][:], f["scalars"][:] = 1.0, 1.0
    f["scalars"][PULL] = np.inf
    f["limits"][0], f["limits"][1], f["budget"][:] = -np.inf, np.inf, budget_of(arena)
    return arena


def increments_of(problem: LevelProblem, rows: Rows) -> Array | None:
    """Returns the optimum of one level alone, (N, n); None if the kernel finds none."""
    arena = arena_of([problem], rows, {})
    return arena.f["U"][0] if solve_level(arena, 0) else None


def solutions(names: Sequence[str], snapshot: Snapshot) -> list[LevelSolution]:
    """Returns the evidence of all levels from the results of a tick."""
    U, cost, kkt, leak, left = (snapshot(name) for name in ("U", "cost", "kkt", "leak", "left"))
    fallbacks: list[Fallback] = [FALLBACKS[int(code)] for code in snapshot("fallback")]
    times = snapshot("time_us").tolist()
    return [
        LevelSolution(
            name,
            U[index],
            float(cost[index]),
            active_rows(snapshot, index),
            float(kkt[index]),
            "unsolved" if fallback not in ("solve", "soften") else "optimal" if left[index] else "empty",
            fallback,
            time_us,
            0.0,
            float(leak[index]),
        )
        for index, (name, fallback, time_us) in enumerate(zip(names, fallbacks, times, strict=True))
    ]


def write_warm_start(arena: Arena, index: int, active: ActiveRows) -> None:
    """Writes the active rows with which a level starts."""
    fits = active.row < len(arena.f["lower"])
    k = min(int(fits.sum()), arena.f["warm_multiplier"].shape[1])
    arena.i["warm_count"][index] = k
    arena.i["warm_row"][index, :k], arena.i["warm_joint"][index, :k] = (
        active.row[fits][:k],
        active.joint[fits][:k],
    )
    arena.f["warm_multiplier"][index, :k] = active.multiplier[fits][:k]


def active_rows(snapshot: Snapshot, index: int) -> ActiveRows:
    """Returns the active rows of a level's solution."""
    k = int(snapshot("active_count")[index])
    if not k:
        return NO_ROWS
    names = ("active_row", "active_joint", "multiplier", "slack")
    return ActiveRows(*(snapshot(name)[index, :k] for name in names))

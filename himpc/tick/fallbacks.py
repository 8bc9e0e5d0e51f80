"""Performs a control period on an `Arena`, which holds the numbers of one controller. All levels share the
arena's budget. A level whose optimum is not found within this budget gets a fallback."""

from __future__ import annotations

from time import perf_counter_ns

import numpy as np

from himpc.cascade.last_resort import containing, last_resort, softened, towards
from himpc.cascade.level import FALLBACKS, Fallback
from himpc.limits import Rows
from himpc.limits.rows import coming_to_rest
from himpc.prediction import JointState
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.arrays import PERIOD, T_S, Array
from himpc.tick.kernel.cascade import ALONE, FIRST, KNOTS, LAST, SOFTENED
from himpc.tick.kernel.control_period import LEVELS, LINEARIZE, NOT_FINITE, ONE_LEVEL, control_period
from himpc.tick.kernel.goldfarb_idnani import TOLERANCE

LEAK = 1e-7
"""m/s²: largest acceptable change of the levels above by a point."""


def perform(arena: Arena, parts: int, like: Rows) -> int:
    """Performs parts of a control period. Returns the number of levels without an optimum, or NOT_FINITE if
    the problems or the torque are not finite.

    The fallbacks are those of `himpc.controllers.printed_tick.solve` and one more, "feasible": if the kernel
    ran out of budget, the increments move from a feasible point towards the last point of the kernel, as far
    as the rows allow. All levels share the budget of the arena, which bounds the time of a tick. If one level
    uses most of the budget, the next levels may need fallbacks as well.

    Args:
        arena: its rows may be wider afterwards: if a fallback widens rows, the levels below use the wider
            rows.
        parts: see `control_period`.
        like: rows with the constraints, directions and L of the arena; their bounds are not used.
    """
    reached, unsolved = control_period(*arena.arguments, parts, 0, 0.0), 0
    while parts & LEVELS and NOT_FINITE < reached < arena.i["sizes"][4]:
        started = perf_counter_ns()
        fallback = _apply_fallback(arena, reached, like)
        arena.f["fallback"][reached] = FALLBACKS.index(fallback)
        arena.f["time_us"][reached] += (perf_counter_ns() - started) / 1e3
        unsolved += fallback != "solve"
        reached = control_period(*arena.arguments, parts & ~LINEARIZE, reached + 1, 0.0)
    return NOT_FINITE if reached == NOT_FINITE else unsolved


def solve_level(arena: Arena, index: int, room: float = 0.0) -> bool:
    """Solves one level; returns whether an optimum was found. room: see the kernel's `solve_level`."""
    return control_period(*arena.arguments, ONE_LEVEL, index, room) != index


def _apply_fallback(arena: Arena, index: int, like: Rows) -> Fallback:
    f = arena.f
    rows = like._replace(lower=f["lower"].copy(), upper=f["upper"].copy())
    wanted = f["U"][index].copy()
    if index and not arena.i["level"][index, ALONE]:
        # If U_{i−1} is almost the only feasible point, opposite bounds nearly coincide. A second attempt
        # widens them a little.
        if solve_level(arena, index, TOLERANCE):
            return "solve"
        above = f["U"][index - 1]
        return _on_the_way(arena, index, containing(rows, above), "inherit", above, f["U"][index].copy())
    rows = rows._replace(rest=_coming_to_rest(arena))
    widened = softened(rows)
    if widened is not None:
        _write(arena, widened)
        solved = solve_level(arena, index)
        wanted = f["U"][index].copy()
        if solved:
            if index:
                _write(arena, rows)
            return "soften"
    optimal = bool(arena.i["known"][1]) and f["fallback"][index] <= SOFTENED
    fallback, U = last_resort(widened or rows, f["U_was"][index].copy() if optimal else None)
    fallback = _on_the_way(arena, index, widened or rows, fallback, U, wanted)
    _write(arena, rows if index else containing(rows, f["U"][index]))
    return fallback


def _on_the_way(
    arena: Arena, index: int, rows: Rows, fallback: Fallback, U: Array, wanted: Array
) -> Fallback:
    """Moves U, which satisfies the rows, towards `wanted`, the point that the kernel reached, if this
    improves the cost. Returns "feasible" after a move, otherwise the argument `fallback`."""
    f = arena.f
    on_the_way = towards(rows, U, wanted)
    if on_the_way is not None and index and not arena.i["level"][index, ALONE]:
        above = slice(0, int(arena.i["level"][index - 1, LAST]))
        if np.abs(f["B"][:, above] @ (on_the_way - U)[:, :, None]).max(initial=0.0) > LEAK:
            on_the_way = None
    if on_the_way is not None and _cost(arena, index, on_the_way) < _cost(arena, index, U):
        fallback, U = "feasible", on_the_way
    f["U"][index], f["kkt"][index], arena.i["active_count"][index] = U, 0.0, 0
    return fallback


def _cost(arena: Arena, index: int, U: Array) -> float:
    """Returns the value (32a) or (34a) of U, (N, n), for a level of an arena that `linearize` has filled."""
    f, level = arena.f, arena.i["level"][index]
    rows, N = slice(int(level[FIRST]), int(level[LAST])), len(U)
    effect = (f["B"][:, rows] @ U[:, :, None])[:, :, 0]
    e = f["root_Q"][rows] * f["free"][:, rows]
    for lag in range(N):
        e[lag:] += f["C"][rows, lag] * effect[: N - lag]
    counted = np.arange(N)[:, None] < arena.i["row_knots"][rows]
    R = f["rho"][index] / f["metric"][index] ** 2
    return float((e[counted] ** 2).sum() + (R * U[: level[KNOTS]] ** 2).sum())


def _coming_to_rest(arena: Arena) -> Array:
    """Returns `Rows.rest` of the state in the arena."""
    f = arena.f
    state = JointState(f["q"], f["v"], (f["v"] - f["v_was"]) / f["scalars"][PERIOD])
    return coming_to_rest(state, f["M_bar"], len(f["L"][0]), float(f["scalars"][T_S]))


def _write(arena: Arena, rows: Rows) -> None:
    arena.f["lower"][:], arena.f["upper"][:] = rows.lower, rows.upper

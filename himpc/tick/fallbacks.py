"""Performs a control period on an `Arena`, which holds the numbers of one controller. All levels share the
arena's budget. A level whose optimum is not found within this budget gets a fallback."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter_ns

import numpy as np

from himpc.cascade.explicit import solve_explicit
from himpc.cascade.last_resort import containing, last_resort, softened, towards
from himpc.cascade.level import FALLBACKS, NO_ROWS, Fallback, Point
from himpc.cascade.null_space import nested_bases, whole_space
from himpc.limits import Rows
from himpc.limits.rows import coming_to_rest
from himpc.prediction.joint import JointState
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.arrays import PERIOD, T_S, Array
from himpc.tick.kernel.cascade import ALONE, LAST, SOFTENED
from himpc.tick.kernel.control_period import LEVELS, LINEARIZE, NOT_FINITE, ONE_LEVEL, control_period
from himpc.tick.kernel.goldfarb_idnani import TOLERANCE
from himpc.tick.printed import printed_problem

_SMALL = 40
"""Largest number of unknowns for which the printed QP is solved after the kernel has failed."""
_ITERATIONS = 100
"""Largest number of iterations of DAQP per attempt. At most two attempts are made; both together take
milliseconds."""

_TOLERATED = 1e-6
"""N·m: rows that must be widened by more than this have no solution on the printed route either."""

LEAK = 1e-7
"""m/s²: largest acceptable change of the levels above by a point."""


@dataclass
class FallbackBudget:
    """The number of times that the printed QP may still be solved in this tick."""

    left: int = 3

    @property
    def spared(self) -> bool:
        """Whether the remaining budget allows all levels to be solved once more."""
        return self.left >= 2


def perform(arena: Arena, parts: int, like: Rows, budget: FallbackBudget) -> int:
    """Performs parts of a control period. Returns the number of levels without an optimum, or NOT_FINITE if
    the problems or the torque are not finite.

    The fallbacks are those of `solve_cascade` and one more, "feasible": if the kernel ran out of budget, the
    increments move from a feasible point towards the last point of the kernel, as far as the rows allow. All
    levels share the budget of the arena, which bounds the time of a tick. If one level uses most of the
    budget, the next levels may need fallbacks as well.

    Args:
        arena: its rows may be wider afterwards: if a fallback widens rows, the levels below use the wider
            rows.
        parts: see `control_period`.
        like: rows with the constraints, directions and L of the arena; their bounds are not used.
        budget: the budget of this tick, from which every printed QP is deducted.
    """
    reached, unsolved = control_period(*arena.arguments, parts, 0, 0.0), 0
    while parts & LEVELS and NOT_FINITE < reached < arena.i["sizes"][4]:
        started = perf_counter_ns()
        fallback = _climb_down(arena, reached, like, budget)
        arena.f["rung"][reached] = FALLBACKS.index(fallback)
        arena.f["time_us"][reached] += (perf_counter_ns() - started) / 1e3
        unsolved += fallback != "solve"
        reached = control_period(*arena.arguments, parts & ~LINEARIZE, reached + 1, 0.0)
    return NOT_FINITE if reached == NOT_FINITE else unsolved


def solve_level(arena: Arena, place: int, room: float = 0.0) -> bool:
    """Solves one level; returns whether an optimum was found. room: see the kernel's `solve_level`."""
    return control_period(*arena.arguments, ONE_LEVEL, place, room) != place


def _climb_down(arena: Arena, place: int, like: Rows, budget: FallbackBudget) -> Fallback:
    f = arena.f
    rows = like._replace(lower=f["lower"].copy(), upper=f["upper"].copy())
    wanted = f["U"][place].copy()
    alone = place == 0 or bool(arena.i["level"][place, ALONE])
    resting = rows._replace(rest=_coming_to_rest(arena)) if alone else rows
    widened = softened(resting) if alone else None
    point = (
        None
        if widened is not None and _contradict(rows, widened)
        else _as_printed(arena, place, rows, budget)
    )
    if point is not None:
        _put(arena, place, point)
        return "solve"
    if not alone:
        # If U_{i−1} is almost the only feasible point, opposite bounds nearly coincide. A second attempt
        # widens them a little.
        if solve_level(arena, place, TOLERANCE):
            return "solve"
        above = f["U"][place - 1]
        return _on_the_way(arena, place, containing(rows, above), "inherit", above, f["U"][place].copy())
    rows = resting
    if widened is not None:
        _write(arena, widened)
        solved = solve_level(arena, place)
        wanted = f["U"][place].copy()
        point = None if solved else _as_printed(arena, place, widened, budget)
        if point is not None:
            _put(arena, place, point)
        if solved or point is not None:
            if place:
                _write(arena, rows)
            return "soften"
    optimal = bool(arena.i["known"][1]) and f["rung"][place] <= SOFTENED
    fallback, U = last_resort(widened or rows, f["U_was"][place].copy() if optimal else None)
    fallback = _on_the_way(arena, place, widened or rows, fallback, U, wanted)
    _write(arena, rows if place else containing(rows, f["U"][place]))
    return fallback


def _contradict(rows: Rows, widened: Rows) -> bool:
    """Returns whether rows have no solution: in `widened`, they were widened by more than solvers
    tolerate."""
    return bool(
        (widened.lower < rows.lower - _TOLERATED).any() or (widened.upper > rows.upper + _TOLERATED).any()
    )


def _on_the_way(
    arena: Arena, place: int, rows: Rows, fallback: Fallback, U: Array, wanted: Array
) -> Fallback:
    """Moves U, which satisfies the rows, towards `wanted`, the point that the kernel reached, if this
    improves the cost. Returns "feasible" after a move, otherwise the argument `fallback`."""
    f = arena.f
    on_the_way = towards(rows, U, wanted)
    if on_the_way is not None and place and not arena.i["level"][place, ALONE]:
        above = slice(0, int(arena.i["level"][place - 1, LAST]))
        if np.abs(f["B"][:, above] @ (on_the_way - U)[:, :, None]).max(initial=0.0) > LEAK:
            on_the_way = None
    if on_the_way is not None:
        problem = printed_problem(arena, place)
        if problem.cost(on_the_way) < problem.cost(U):
            fallback, U = "feasible", on_the_way
    _put(arena, place, Point(U, NO_ROWS, 0.0, "unsolved"))
    return fallback


def _coming_to_rest(arena: Arena) -> Array:
    """Returns `Rows.rest` of the state in the arena."""
    f = arena.f
    state = JointState(f["q"], f["v"], (f["v"] - f["v_was"]) / f["scalars"][PERIOD])
    return coming_to_rest(state, f["M_bar"], len(f["L"][0]), float(f["scalars"][T_S]))


def _as_printed(arena: Arena, place: int, rows: Rows, budget: FallbackBudget) -> Point | None:
    """Computes the level's optimum by the printed route, if the problem is small and the budget of this tick
    is not used up."""
    N, n = arena.f["U"][place].shape
    if N * n > _SMALL or budget.left <= 0:
        return None
    budget.left -= 1
    alone = bool(arena.i["level"][place, ALONE])
    upper = [] if alone else [printed_problem(arena, p).B for p in range(place)]
    U_above = np.zeros((N, n)) if alone or not place else arena.f["U"][place - 1]
    Z = nested_bases(upper)[-1] if upper else whole_space(N, n)
    above = [(B, arena.f["U"][p]) for p, B in enumerate(upper)]
    return solve_explicit(printed_problem(arena, place), rows, U_above, above, Z, "daqp", _ITERATIONS)


def _write(arena: Arena, rows: Rows) -> None:
    arena.f["lower"][:], arena.f["upper"][:] = rows.lower, rows.upper


def _put(arena: Arena, place: int, point: Point) -> None:
    """Writes the point of a level that another solver than the kernel has found."""
    f, i, active = arena.f, arena.i, point.active
    f["U"][place], f["kkt"][place], i["active_count"][place] = point.U, point.kkt_residual, len(active)
    here = place, slice(0, len(active))
    i["active_row"][here], i["active_joint"][here] = active.row, active.joint
    f["multiplier"][here], f["slack"][here] = active.multiplier, active.slack

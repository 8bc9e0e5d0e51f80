"""The levels of a cascade as arrays: rows, weights, and the effect of increments on the residual."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from himpc.limits import POSITION, TORQUE, VELOCITY
from himpc.limits.constraint import Constraint
from himpc.limits.velocity import approached, reaction
from himpc.qp import KKT_TOLERANCE
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.arrays import PULL, REACTION, Array, sizes_of

if TYPE_CHECKING:
    from himpc.formulation.forms import StackForm
    from himpc.formulation.settings import Settings

BUDGET = 50e6
"""Largest number of multiplications for changes of active rows in one tick. They take about ten milliseconds,
less than twenty on a slower core. The limit is a count and not a time, so that the same seed gives the same
run."""
_ROUNDS = 12_000
"""Largest number of changes of active rows in one tick; a tick that reaches it takes a few milliseconds."""
ACCURACY = 1e-8
"""N·m: largest distance of a point from the optimum, since H ≥ ρ."""


_BUILT_IN = (TORQUE, VELOCITY, POSITION)


def python_constraints(constraints: Sequence[Constraint]) -> Sequence[Constraint]:
    """Returns the constraints whose bounds the kernel does not compute itself. They come last in
    `constraints`."""
    known = sum(one is other for one, other in zip(constraints, _BUILT_IN, strict=False))
    return constraints[known:]


def budget_of(arena: Arena) -> float:
    """Returns the number of multiplications that a tick may use for changes of active rows: BUDGET, but at
    most the number for _ROUNDS changes, because each change has a fixed cost even in a small problem."""
    N, n = arena.f["U"].shape[1:]
    return min(BUDGET, _ROUNDS * (N * n * n + 4.0 * arena.f["lower"].size))


def write_levels(arena: Arena, levels: Sequence[tuple[slice, int, Array]], alone: bool = False) -> None:
    """Writes the table of levels.

    Args:
        levels: the rows, the knots K of the residual and the weight R (n,) of each level.
        alone: whether the levels are exempt from (33). Level p then has the cost of levels 1 … p, and the
            evidence of its own cost.
    """
    f, first, K, R = arena.f, 0, 0, np.zeros(arena.f["R"].shape[1])
    for index, (rows, own_K, own_R) in enumerate(levels):
        first, K, R = (0, max(K, own_K), R + own_R) if alone else (rows.start, own_K, own_R)
        rho = float(R.min())
        metric = np.sqrt(rho / R)
        f["rho"][index], f["metric"][index], f["R"][index] = rho, metric, own_R
        f["accuracy"][index] = min(ACCURACY * rho, KKT_TOLERANCE)
        afresh = index > 0 and bool((f["metric"][index - 1] != metric).any())
        arena.i["level"][index] = first, rows.stop, K, afresh, alone, rows.start, rows.stop, own_K


def write_effects(
    arena: Arena, rows: slice, root_Q: Array, C: Array, K: int, share: float | Array = 1.0
) -> None:
    """Writes √Q and the effect coefficients √Q c_l of some rows.

    Args:
        rows, root_Q, C, K: as `rows`, `root_Q`, `C` and `knots` of `LevelForm`.
        share: factor on √Q, one number or one per row.
    """
    f, by_row = arena.f, np.broadcast_to(share, root_Q.shape)
    f["root_Q"][rows] = by_row * root_Q
    weighted_C = by_row[:, None] * (root_Q[:, None] * C[:K, :, :K])
    f["C"][rows, :K] = weighted_C[:, :, 0].T
    # A row with fewer knots is padded with zeros. Only in the padding, its effect on the next knot is zero:
    # this shows the number of its knots.
    arena.i["row_knots"][rows] = (np.diagonal(weighted_C, axis1=0, axis2=2) > 0.0).sum(axis=1)
    of_rows = weighted_C.transpose(1, 0, 2)
    f["S"][rows, :K, :K] = of_rows.transpose(0, 2, 1) @ of_rows


def write_numbers(
    arena: Arena, settings: Settings, form: StackForm, idle: bool = False, alone: bool = False
) -> None:
    """Writes the numbers of settings, see `NUMBERS`, to an arena for settings of the same structure.

    Args:
        form: the levels. idle: whether no level is solved. alone: see `write_levels`.
    """
    f, model, limits, m = arena.f, form.model, settings.limits, sum(form.sizes)
    f["M_bar"][:] = settings.M_bar
    f["K_p"][:m], f["K_v"][:m] = model.K_p, model.K_v
    f["on_velocity"][:, :m], f["on_acceleration"][:, :m] = model.on_velocity, model.on_acceleration
    for level in form.levels:
        write_effects(arena, level.rows, level.root_Q, level.C, level.knots)
    solved = () if idle else form.levels
    write_levels(arena, [(level.rows, level.knots, level.R) for level in solved], alone)
    f["approach"][:] = approached(settings.horizon, limits.velocity_approach * settings.T_s)[:, 0]
    f["scalars"][REACTION], f["scalars"][PULL] = (
        reaction(limits, settings.T_s),
        limits.avoidance.largest_error,
    )


def sizes(
    n: int,
    N: int,
    rows: int,
    solved: int,
    levels: int,
    bounds: int,
    tasks: int = 1,
    frames: int = 1,
    python_rows: int = 1,
    directed: int = 0,
    placements: int = 1,
) -> Arena:
    """Returns an arena for n joints and N knots.

    Args:
        n, N: number of joints and of knots.
        rows, solved: number of rows of all tasks, and of the solved tasks, whose rows come first.
        levels, bounds, tasks, frames: number of each.
        python_rows: number of rows of tasks that are not built into the kernel, at least 1.
        directed: number of constraints that are not built into the kernel.
        placements: number of joints, with those that follow others, and the world.
    """
    numbers = [n, N, rows, solved, levels, tasks, frames, bounds, N * n, 0, python_rows, directed, placements]
    arena = Arena(sizes_of(numbers))
    arena.i["sizes"][:] = numbers
    return arena

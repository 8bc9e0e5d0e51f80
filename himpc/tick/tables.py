"""The levels of a cascade as arrays: rows, weights, and the effect of increments on the residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from himpc.limits import POSITION, TORQUE, VELOCITY
from himpc.limits.constraint import Constraint
from himpc.qp import KKT_TOLERANCE
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.arrays import Array, sizes_of

if TYPE_CHECKING:
    from himpc.formulation.forms import LevelForm

BUDGET = 50e6
"""Largest number of multiplications for changes of active rows in one tick. They take about ten milliseconds,
less than twenty on a slower core. The limit is a count and not a time, so that the same seed gives the same
run."""
_ROUNDS = 12_000
"""Largest number of changes of active rows in one tick; a tick that reaches it takes a few milliseconds."""
ACCURACY = 1e-8
"""N·m: largest distance of a point from the optimum, since H ≥ ρ."""


@dataclass(frozen=True, eq=False)
class LevelTable:
    """The data of a level for the kernel.

    Attributes:
        rows: its rows among the rows of all levels.
        knots: number of knots K of its residual.
        R: (n,) weight of the increments.
        own_rows, own_knots, own_R: rows, knots and R for the level's evidence; they differ from the others
            only without priorities.
        alone: whether the level is exempt from (33).
    """

    rows: slice
    knots: int
    R: Array
    own_rows: slice
    own_knots: int
    own_R: Array
    alone: bool = False

    @classmethod
    def of(cls, level: LevelForm) -> LevelTable:
        """Returns the table of a level of a strict hierarchy."""
        return cls(level.rows, level.knots, level.R, level.rows, level.knots, level.R)


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


def write_levels(arena: Arena, levels: Sequence[LevelTable]) -> None:
    """Writes the table of levels."""
    f = arena.f
    for index, level in enumerate(levels):
        rho = float(level.R.min())
        metric = np.sqrt(rho / level.R)
        f["rho"][index], f["metric"][index], f["R"][index] = rho, metric, level.own_R
        f["accuracy"][index] = min(ACCURACY * rho, KKT_TOLERANCE)
        arena.i["level"][index] = (
            level.rows.start,
            level.rows.stop,
            level.knots,
            index > 0 and bool((f["metric"][index - 1] != metric).any()),
            level.alone,
            level.own_rows.start,
            level.own_rows.stop,
            level.own_knots,
        )


def write_effects(arena: Arena, rows: slice, root_Q: Array, weighted_C: Array) -> None:
    """Writes √Q and the effect coefficients √Q c_l of some rows; (m,) and (K, m, K) of `LevelForm`."""
    f, K = arena.f, len(weighted_C)
    f["root_Q"][rows] = root_Q
    f["C"][rows, :K] = weighted_C[:, :, 0].T
    # A row with fewer knots is padded with zeros. Only in the padding, its effect on the next knot is zero:
    # this shows the number of its knots.
    arena.i["row_knots"][rows] = (np.diagonal(weighted_C, axis1=0, axis2=2) > 0.0).sum(axis=1)
    by_row = weighted_C.transpose(1, 0, 2)
    f["S"][rows, :K, :K] = by_row.transpose(0, 2, 1) @ by_row


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

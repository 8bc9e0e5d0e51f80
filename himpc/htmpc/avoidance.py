"""Collision avoidance (7c) along the prediction: rows, slacks and penalties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.clearance import Clearances, CollisionModel
from himpc.htmpc.geometry import Placed
from himpc.htmpc.kernel.kinds import COLLISION
from himpc.htmpc.prediction import integrator
from himpc.htmpc.rows import ConstraintRows, ConstraintTable

Array = NDArray[np.float64]

PENALTY = 1e3
"""Penalty per metre of violation of the margin at one knot; it exceeds every gain in tracking."""
_LOOK = 0.35
"""A pair gets no row if its distance exceeds the margin by more than this, m. This distance exceeds the
change of a knot's position in one SQP step."""


@dataclass(frozen=True, eq=False)
class Avoidance:
    """The constraint sd(x_k) ≥ δ_safe.

    Attributes:
        model: computes distances and gradients.
        margin: δ_safe, m.
    """

    model: CollisionModel
    margin: float

    def near(self, joints: Placed, gradients: bool = True) -> Clearances:
        """Returns the pairs that are close enough to be relevant at some configurations."""
        return self.model.between(joints, self.margin + _LOOK, gradients)

    def rows(
        self, near: Clearances, N: int, dt: float, table: ConstraintTable | None = None, row: int = 0
    ) -> ConstraintRows:
        """Writes the linearised constraint on the change d of the inputs to a table, from `row` on.
        Returns these rows, one per pair and knot."""
        table = ConstraintTable(N * near.gradient.shape[1]) if table is None else table
        A = table.spread(row, near.knot, near.gradient, integrator(N, dt).T_q)
        room = self.margin - near.distance
        free = np.full(len(room), np.inf)
        return ConstraintRows(A, room, free, np.full(len(room), COLLISION), near.knot + 1, near.pair)

    def depths(self, near: Clearances, N: int) -> Array:
        """Returns the largest violation of the margin at each knot, (N,) m, ≥ 0."""
        depth = np.zeros(N)
        np.maximum.at(depth, near.knot, self.margin - near.distance)
        return depth


def clearance(near: Clearances | None) -> float:
    """Returns the smallest distance, m; infinite if no pair is near."""
    return np.inf if near is None else float(near.distance.min(initial=np.inf))

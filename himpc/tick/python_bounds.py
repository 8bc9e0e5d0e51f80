"""Computes the bounds of constraints that are not built into the kernel, in Python, and writes them to the
arena."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from himpc.formulation.settings import Settings
from himpc.limits import LimitsInForce, Rows
from himpc.limits.constraint import Constraint, Directions, Moment
from himpc.limits.distance import DISTANCE
from himpc.prediction import JointState
from himpc.references.outlook import Observed
from himpc.tick.distances import Distances
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.arrays import PERIOD
from himpc.tick.tables import python_constraints


class PythonBounds:
    """The constraints of `python_constraints`. Their bounds are written to the arena before the levels
    are solved. The kernel computes the bounds of distances, from objects that are stored in Python."""

    def __init__(self, arena: Arena, constraints: Sequence[Constraint], distances: Distances | None) -> None:
        self._arena, self._distances = arena, distances
        self._constraints = python_constraints(constraints)
        self._known = len(constraints) - len(self._constraints)

    def write(self, rows: Rows, settings: Settings, force: LimitsInForce, observed: Observed) -> Rows:
        """Writes bounds and directions of this tick; returns the rows with the directions. The directions of
        distances are views of the arena, and change at the next tick.

        Args:
            rows: rows with the constraints of the arena.
            settings: the settings in use.
            force: the limits in force. The measured state and the memory are read from the arena.
            observed: the objects around the robot.
        """
        if not self._constraints:
            return rows
        f, N, now = self._arena.f, settings.horizon, None
        directions: list[Directions | None] = [None] * self._known
        for index, constraint in enumerate(self._constraints):
            if constraint is DISTANCE and self._distances is not None:
                self._distances.observe(observed)
                pairs = self._distances.write(self._arena, index)
                directions.append(Directions(f["direction"][index], pairs))
                continue
            now = now or self._moment(settings, force)
            block = constraint.bounds(now)
            start = (self._known + index) * N
            f["lower"][start : start + N], f["upper"][start : start + N] = block.lower, block.upper
            f["direction"][index] = np.eye(len(f["q"])) if block.directions is None else block.directions.D
            directions.append(block.directions)
        return rows._replace(directions=tuple(directions) if any(directions) else ())

    def _moment(self, settings: Settings, force: LimitsInForce) -> Moment:
        f = self._arena.f
        state = JointState(f["q"], f["v"], (f["v"] - f["v_was"]) / f["scalars"][PERIOD])
        N, T_s = settings.horizon, settings.T_s
        return Moment(state, f["tau_0"], f["M_bar"], settings.limits, force, N, T_s)

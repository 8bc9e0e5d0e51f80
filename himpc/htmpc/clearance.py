"""Signed distances between a robot's spheres and obstacles or the robot's base, in closed form, with
gradients; and collision avoidance (7c) along the prediction: rows, slacks and penalties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from himpc.htmpc.kernel.kinds import COLLISION
from himpc.htmpc.kinematics import Placed, geometry, placed
from himpc.htmpc.prediction import integrator
from himpc.htmpc.rows import ConstraintRows, ConstraintTable
from himpc.tick.kernel.near import near
from robots import Robot
from robots.arrays import Array, Indices
from robots.collision import Obstacle, surroundings


@dataclass(frozen=True, eq=False)
class Clearances:
    """Distances of the nearest pairs at all knots.

    Attributes:
        knot: (r,) index of the configuration.
        distance: (r,) m, negative inside.
        gradient: (r, n) of the distance with respect to q, m/rad.
        sphere, shape: (r,) indices of the pair.
        links: names of the spheres' links. names: names of the shapes.
    """

    knot: Indices
    distance: Array
    gradient: Array
    sphere: Indices
    shape: Indices
    links: tuple[str, ...]
    names: tuple[str, ...]

    @property
    def pair(self) -> Indices:
        """(r,) index of the pair of each distance, see `CollisionModel.named`."""
        return self.shape * len(self.links) + self.sphere

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """The (sphere's link, obstacle's name) of each distance."""
        indices = zip(self.sphere.tolist(), self.shape.tolist(), strict=True)
        return [(self.links[sphere], self.names[shape]) for sphere, shape in indices]


class CollisionModel:
    """Distances of a robot's spheres to obstacles, and of its arm's spheres to its own base."""

    def __init__(self, robot: Robot, obstacles: tuple[Obstacle, ...], self_collision: bool = False) -> None:
        self._tree = geometry(robot)
        self._around = surroundings(robot, obstacles, self_collision)
        self._meets = self._around.meets.astype(np.intp)

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the links that carry the spheres."""
        return self._around.links

    @property
    def empty(self) -> bool:
        """Whether there are no pairs to check."""
        return not self._around.names

    def named(self, pair: int) -> str:
        """Returns the names of a pair: its link, and the obstacle or the other link."""
        shape, sphere = divmod(pair, len(self.links))
        return f"{self.links[sphere]} – {self._around.names[shape]}"

    def clearances(self, q: Array, within: float, gradients: bool = True) -> Clearances:
        """Returns all pairs nearer than `within`, m, at configurations q (K, n). If `gradients` is false, the
        array of gradients is empty."""
        return self.between(placed(self._tree, q), within, gradients)

    def between(self, where: Placed, within: float, gradients: bool = True) -> Clearances:
        """Returns the same distances as `clearances`, computed from known placements of the joints."""
        around, tree = self._around, self._tree
        K, S = len(where.at), len(around.radius)
        most = K * S * len(around.names)
        knot, sphere, shape = np.empty((3, most + 1), np.intp)
        distance, normal = np.empty(most + 1), np.empty((most + 1, 3))
        gradient = np.empty((most if gradients else 0, tree.moves.shape[1]))
        count = near(
            *(*where, *tree.of_joints[1:], tree.carries, around.joint, around.centre, around.span),
            *(around.radius, around.kind, around.carrier, around.turn, around.middle, around.half),
            *(around.thickness, self._meets, within, np.empty((K, S, 3)), np.empty((K, S, 3))),
            *(knot, sphere, shape, np.empty(most + 1), distance, normal, gradient),
        )
        columns = (knot[:count], distance[:count], gradient[:count], sphere[:count], shape[:count])
        return Clearances(*columns, around.links, around.names)


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

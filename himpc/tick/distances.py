"""The nearest pairs of a robot's links and of what is around it, by the compiled kernel."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from himpc.constants import WITHIN
from himpc.kinematics.geometry import geometry
from himpc.limits.constraint import Directions
from himpc.limits.distance import Near, row_count
from himpc.limits.limits import Limits
from himpc.limits.stall import PROGRESS
from himpc.references.observed import NOTHING, Observed
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.distance_rows import distance_rows, nearest, place_joints
from himpc.tick.kernel.near import near
from robots import Robot
from robots.cover import cover_of
from robots.cover_shapes import cover_surroundings, middles

Array = NDArray[np.float64]


class Distances:
    """The cover of a robot and the objects that a controller knows, as arrays for the kernel.

    Attributes:
        nearest: the smallest distance found last, m; infinite without any within `WITHIN`.
    """

    @property
    def moves(self) -> bool:
        """Whether an object with a row moves."""
        return bool(np.any(np.abs(self._moving) > PROGRESS))

    def __init__(self, robot: Robot) -> None:
        self._robot, self._tree, self._data = robot, geometry(robot), robot.model.createData()
        self._cover = cover_of(robot)
        self._chosen = np.zeros(row_count(robot.n), np.intp)
        self._moving = np.zeros(len(self._chosen))
        self._observed: Observed | None = None
        self.nearest = math.inf
        self.observe(NOTHING)

    def observe(self, observed: Observed) -> None:
        """Takes over where the objects are."""
        before, self._observed = self._observed, observed
        if before is not None and observed.shapes is before.shapes:
            return
        if before is not None and list(map(_kind, observed.shapes)) == list(map(_kind, before.shapes)):
            self._around.middle[: len(observed.shapes)] = middles(observed.shapes)
            return
        self._around = around = cover_surroundings(self._robot, self._cover, observed.shapes)
        S, most = len(around.radius), max(int(around.meets.sum()), 1)
        self._scratch = np.empty((1, S, 3)), np.empty((1, S, 3))
        self._pair = np.zeros((3, most + 1), np.intp)
        self._taken = np.zeros(most + 1, np.intp)
        self._share, self._distance = np.empty(most + 1), np.empty(most + 1)
        self._normal, self._slopes = np.empty((most + 1, 3)), np.empty((most + 1, self._robot.n))
        self._names = [[f"{link} – {name}" for link in around.links] for name in around.names]

    def _find(self, placed: Array, z: Array) -> int:
        """Chooses the nearest pairs for the placements of the joints, (1, n+1, …) each; returns their
        number."""
        around, tree = self._around, self._tree
        knot, sphere, shape = self._pair
        found = near(
            *(placed, z, tree.is_revolute, tree.moves, around.joint, around.centre, around.span),
            *(around.radius, around.kind, around.carrier, around.turn, around.middle, around.half),
            *(around.thickness, around.meets, WITHIN, *self._scratch),
            *(knot, sphere, shape, self._share, self._distance, self._normal, self._slopes),
        )
        count = nearest(found, self._distance, self._chosen, self._taken)
        velocity = None if self._observed is None else self._observed.velocity
        self.nearest = float(self._distance[self._chosen[0]]) if count else math.inf
        self._moving[:] = 0.0
        if velocity is not None:
            for c, pair in enumerate(self._chosen[:count].tolist()):
                if shape[pair] < len(velocity):
                    self._moving[c] = self._normal[pair] @ velocity[shape[pair]]
        return count

    def _named(self, count: int) -> tuple[str, ...]:
        _, sphere, shape = self._pair
        chosen = self._chosen[:count]
        return tuple(
            self._names[o][s] for o, s in zip(shape[chosen].tolist(), sphere[chosen].tolist(), strict=True)
        )

    def at(self, q: Array) -> Near:
        """The nearest pairs at the positions q, (n,)."""
        model, tree = self._robot.model, self._tree
        pin.forwardKinematics(model, self._data, q)
        placed = np.array([[*each.rotation.ravel(), *each.translation] for each in self._data.oMi])
        z = np.array([each.rotation @ axis for each, axis in zip(self._data.oMi, tree.axis, strict=True)])
        count = self._find(placed[None], z[None])
        chosen = self._chosen[:count]
        return Near(
            self._distance[chosen], self._slopes[chosen], self._moving[:count].copy(), self._named(count)
        )

    def write(self, arena: Arena, block: int, limits: Limits) -> Directions:
        """Writes the rows of this tick to an arena that holds the measured state.

        block: which set of directions is that of distances.
        """
        avoidance = limits.avoidance
        place_joints(*arena.arguments)
        count = self._find(arena.f["placed"][None], arena.f["axis_now"][None])
        numbers = np.array([avoidance.d_safe + avoidance.margin, avoidance.reaction, avoidance.deceleration])
        distance_rows(
            *(*arena.arguments, block, count, self._chosen),
            *(self._distance, self._slopes, self._moving, numbers),
        )
        n = self._robot.n
        names = self._named(count)
        return Directions(arena.f["direction"][block].copy(), (*names, *[""] * (n - count)))


def _kind(shape: object) -> tuple:
    """What stays when an object moves."""
    return type(shape), getattr(shape, "name", ""), getattr(shape, "size", getattr(shape, "radius", 0.0))

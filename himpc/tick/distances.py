"""The nearest pairs of links, and of links and objects, by the compiled kernel."""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.constants import PROGRESS, WITHIN
from himpc.kinematics.geometry import Geometry, geometry
from himpc.limits.avoidance import Avoidance
from himpc.limits.distance import row_count
from himpc.limits.near import Near
from himpc.references.observed import Observed
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.distance_rows import (
    CHANGED,
    FASTEST,
    ROOM,
    distance_rows,
    nearest,
)
from himpc.tick.kernel.near import near
from himpc.tick.kernel.placements import place_all
from robots import Robot
from robots.collision import Surroundings
from robots.cover_shapes import WorldShape, cover_surroundings, placements
from robots.covering.cover_of import cover_of
from robots.per_robot import per_robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_AT_HOME = 0.5
"""The distance that two links must keep is at most this share of their distance at home. Otherwise d_safe
could forbid the home posture."""
_GRID = 15
"""Number of positions of each joint between two links that are checked."""
_NEVER = 0.03
"""m: two links with at most two joints between them need no row if they are farther apart in all postures."""


_STILL = np.zeros((0, 3))
"""The velocities of objects that are at rest."""


class _Pairs:
    """The near pairs of capsules and shapes. The arrays have space for all pairs of the surroundings.

    Attributes:
        count: number of pairs.
        sphere, shape: (count,) or more, indices of the capsule and of the shape of each pair. distance: m.
            normal: (·, 3). slopes: (·, n).
    """

    def __init__(self, tree: Geometry, around: Surroundings) -> None:
        self._tree, self.around = tree, around
        S, most = len(around.radius), int(around.meets.sum()) + 1
        self._joints = *tree.of_joints, tree.rotation, tree.translation, tree.axis
        self._q = np.empty((1, tree.moves.shape[1]))
        self._placed = np.empty((1, len(tree.parent), 12)), np.empty((1, len(tree.parent), 3))
        self._scratch = np.empty((1, S, 3)), np.empty((1, S, 3))
        self._knot, self.sphere, self.shape = np.zeros((3, most), np.intp)
        self._share, self.distance = np.empty(most), np.empty(most)
        self.normal, self.slopes = np.empty((most, 3)), np.empty((most, tree.moves.shape[1]))
        self.count = 0

    def find(self, q: Array, within: float) -> None:
        """Finds the pairs nearer than `within`, m, at the positions q, (n,)."""
        around, tree = self.around, self._tree
        self._q[0] = q
        place_all(*self._joints, self._q, *self._placed)
        self.count = near(
            *(*self._placed, *tree.of_joints[1:], tree.carries, around.joint, around.centre, around.span),
            *(around.radius, around.kind, around.carrier, around.turn, around.middle, around.half),
            *(around.thickness, around.meets, within, *self._scratch),
            *(self._knot, self.sphere, self.shape, self._share, self.distance, self.normal, self.slopes),
        )


class _Links(NamedTuple):
    """The pairs of links of a robot that are checked, as two tables (S, S): which capsules form a pair, and
    the upper limit of the distance, m, that a pair must keep."""

    meets: NDArray[np.bool_]
    kept: Array


@per_robot
def _links(robot: Robot) -> _Links:
    """Returns all pairs of `cover_surroundings`, except links with at most two joints between them that are
    never nearer than _NEVER. With rows for such links, pairs that can touch would get fewer rows."""
    tree, around = geometry(robot), cover_surroundings(robot, cover_of(robot), ())
    between: dict[tuple[int, ...], list[tuple[int, int]]] = {}
    for o, s in np.argwhere(around.meets).tolist():
        between_them = tree.carries[around.joint[o]] != tree.carries[around.joint[s]]
        joints = np.unique(tree.column[between_them])
        if len(joints) <= 2:
            between.setdefault(tuple(joints.tolist()), []).append((o, s))
    low = np.where(np.isfinite(robot.q_lower), robot.q_lower, -np.pi)
    high = np.where(np.isfinite(robot.q_upper), robot.q_upper, np.pi)
    meets = around.meets.copy()
    for joints, pairs in between.items():
        only = np.zeros_like(meets)
        only[tuple(np.transpose(pairs))] = True
        search, close, q = _Pairs(tree, around._replace(meets=only)), np.zeros_like(meets), robot.home.copy()
        for values in product(*(np.linspace(low[j], high[j], _GRID) for j in joints)):
            q[list(joints)] = values
            search.find(q, _NEVER)
            close[search.shape[: search.count], search.sphere[: search.count]] = True
        meets &= ~only | close
    kept, search = np.full(meets.shape, np.inf), _Pairs(tree, around._replace(meets=meets))
    search.find(robot.home, WITHIN)
    at = search.shape[: search.count], search.sphere[: search.count]
    kept[at] = _AT_HOME * np.maximum(search.distance[: search.count], 0.0)
    return _Links(meets, kept)


def carried(robot: Robot) -> NDArray[np.bool_]:
    """Returns whether the motor of joint j carries joint k, (n, n), entry [k, j]; true for k = j."""
    return np.ascontiguousarray(geometry(robot).moves[list(robot.joints)] > 0)


class Distances:
    """Computes the distances of a robot's cover from the objects that a controller knows, and between its
    links.

    Attributes:
        carried: see the function `carried`.
        velocity_margin: see `Avoidance`.
    """

    def __init__(self, robot: Robot, avoidance: Avoidance) -> None:
        self._robot, self._avoidance = robot, avoidance
        self._chosen = np.zeros(row_count(robot.n), np.intp)
        self._links, self._others = np.full((2, len(self._chosen)), -1)
        self._moving, self._share = np.zeros(len(self._chosen)), np.ones(len(self._chosen))
        self._about, self._named = np.array([math.inf, 0.0, 0.0]), ("",) * robot.n
        self._numbers = np.array(
            (avoidance.d_safe, avoidance.margin, avoidance.reaction, avoidance.deceleration)
        )
        # A joint without a limit gets the largest limit of the other joints.
        limited = np.isfinite(robot.v_limit)
        self._fastest = np.where(limited, robot.v_limit, robot.v_limit[limited].max(initial=1.0))
        self.carried = carried(robot)
        self.velocity_margin = avoidance.velocity_margin
        self._observed: Observed | None = None

    @property
    def room(self) -> float:
        """The smallest difference, m, between the distance of a pair at the last tick and the distance that
        the pair must keep. Infinite if no pair was within `WITHIN`."""
        return float(self._about[ROOM])

    @property
    def moves(self) -> bool:
        """Whether an object with a row moves."""
        return bool(self._about[FASTEST] > PROGRESS)

    def observe(self, observed: Observed) -> None:
        """Stores the present placements of the objects."""
        before, self._observed = self._observed, observed
        if before is None or before.shapes != observed.shapes:
            if before and list(map(_kind, observed.shapes)) == list(map(_kind, before.shapes)):
                around, B = self._pairs.around, len(observed.shapes)
                around.turn[:B], around.middle[:B] = placements(observed.shapes)
            else:
                self._know(observed)

    def _know(self, observed: Observed) -> None:
        """Prepares the arrays for a new set of objects."""
        around = cover_surroundings(self._robot, cover_of(self._robot), observed.shapes)
        links, B = _links(self._robot), len(observed.shapes)
        around.meets[B:] = links.meets
        kept = self._avoidance.d_safe + self._avoidance.margin
        self._shares = np.ones(around.meets.shape)
        if kept > 0.0:
            self._shares[B:] = np.minimum(1.0, links.kept / kept)
        self._pairs = _Pairs(geometry(self._robot), around)
        self._times = np.empty(len(self._pairs.distance))
        self._links[:], self._named = -1, ("",) * self._robot.n
        self._names = [[f"{link} – {name}" for link in around.links] for name in around.names]

    def _find(self, q: Array) -> int:
        """Chooses the nearest pairs at the positions q; returns their number."""
        assert self._observed is not None
        pairs, velocity = self._pairs, self._observed.velocity
        pairs.find(q, WITHIN)
        count = nearest(
            *(pairs.count, pairs.distance, pairs.sphere, pairs.shape, pairs.normal, pairs.slopes),
            *(self._shares, _STILL if velocity is None else velocity, self._fastest),
            *(self._avoidance.d_safe, self._times, self._chosen),
            *(self._links, self._others, self._share, self._moving, self._about),
        )
        if self._about[CHANGED]:
            at = zip(self._others[:count].tolist(), self._links[:count].tolist(), strict=True)
            names = [self._names[other][link] for other, link in at]
            self._named = (*names, *[""] * (self._robot.n - count))
        return count

    def at(self, q: Array, observed: Observed) -> Near:
        """Returns the nearest pairs at the positions q, (n,)."""
        self.observe(observed)
        count = self._find(q)
        pairs, chosen = self._pairs, self._chosen[:count]
        moving, share = self._moving[:count].copy(), self._share[:count].copy()
        return Near(pairs.distance[chosen], pairs.slopes[chosen], moving, share, self._named[:count])

    def write(self, arena: Arena, block: int) -> tuple[str, ...]:
        """Writes the rows of this tick to an arena that holds the measured state; returns the name of each
        row's pair, (n,).

        block: index of the set of directions for distances.
        """
        pairs = self._pairs
        count = self._find(arena.f["q"])
        distance_rows(
            *(*arena.arguments, block, count, self._chosen, pairs.distance, pairs.slopes),
            *(self._moving, self._share, self._numbers),
        )
        return self._named


class Anywhere(NamedTuple):
    """Stands for the distances of a controller that keeps none: an obstacle may be near at any time.

    Attributes:
        carried, velocity_margin, room, moves: as for `Distances`.
    """

    carried: NDArray[np.bool_]
    velocity_margin: float
    room: float = 0.0
    moves: bool = False


def _kind(shape: WorldShape) -> tuple[object, ...]:
    """Returns the data of a shape that stay constant when the object moves."""
    fixed = (value for name, value in vars(shape).items() if name not in ("centre", "foot", "yaw"))
    return type(shape), *fixed

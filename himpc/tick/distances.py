"""The nearest pairs of links, and of links and objects, by the compiled kernel."""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.constants import MOVING, MOVING_ANYWHERE, WITHIN
from himpc.kinematics.geometry import Geometry, geometry
from himpc.limits.constraint import Near
from himpc.limits.distance import row_count
from himpc.limits.limits import Avoidance
from himpc.references.outlook import NOTHING, Observed
from himpc.tick.kernel.arena import Arena, laid_out
from himpc.tick.kernel.distance_rows import (
    CHANGED,
    FASTEST,
    ROOM,
    chosen_pairs,
    distance_rows,
    near_pairs,
)
from himpc.tick.kernel.pair_arrays import PAIR_NUMBERS, PAIR_WHOLES, pair_sizes
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


PairMemory = tuple[Array, Indices, Indices, Indices]
"""The four arrays of the pairs that compiled functions receive."""


def pair_memory(*numbers: int) -> tuple[PairMemory, dict[str, Array], dict[str, Indices]]:
    """Returns the arrays that compiled functions receive, and the arrays of `PairArrays` by name. numbers:
    n, J, S, O, P and R."""
    sizes = pair_sizes(np.array(numbers))._asdict()
    data, where, f = laid_out(PAIR_NUMBERS, sizes, np.float64)
    whole, whole_where, i = laid_out(PAIR_WHOLES, sizes, np.intp)
    i["counts"][:] = numbers
    return (data, where, whole, whole_where), f, i


class _Pairs:
    """The arrays of the pairs of capsules and shapes, see `PairArrays`. They have space for all pairs of the
    surroundings.

    Attributes:
        around: the surroundings.
        f, i: the arrays by name. arguments: the four arrays that compiled functions receive.
    """

    def __init__(self, tree: Geometry, around: Surroundings, rows: int = 0) -> None:
        (J, n), (O, S) = tree.moves.shape, around.meets.shape
        self.around = around
        self.arguments, self.f, self.i = pair_memory(n, J, S, O, int(around.meets.sum()) + 1, rows)
        for name, table in (tree._asdict() | around._asdict()).items():
            if name in self.f or name in self.i:
                (self.f if name in self.f else self.i)[name][:] = table
        self.i["link"][:], self.i["other"][:], self.f["share"][:] = -1, -1, 1.0
        self.f["about"][ROOM] = math.inf

    def find(self, q: Array, within: float) -> tuple[Indices, Indices, Array]:
        """Returns shape, capsule and distance, m, of the pairs nearer than `within`, m, at the positions q,
        (n,)."""
        count = near_pairs(*self.arguments, q, within)
        return self.i["shape"][:count], self.i["sphere"][:count], self.f["distance"][:count]


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
            close[search.find(q, _NEVER)[:2]] = True
        meets &= ~only | close
    kept, search = np.full(meets.shape, np.inf), _Pairs(tree, around._replace(meets=meets))
    *at, distance = search.find(robot.home, WITHIN)
    kept[tuple(at)] = _AT_HOME * np.maximum(distance, 0.0)
    return _Links(meets, kept)


def carried(robot: Robot) -> Array:
    """Returns whether the motor of joint j carries joint k, (n, n), entry [k, j]; 1 for k = j."""
    return np.ascontiguousarray(geometry(robot).moves[list(robot.joints)])


class Distances:
    """Computes the distances of a robot's cover from the objects that a controller knows, and between its
    links.

    Attributes:
        carried: see the function `carried`.
        velocity_margin: see `Avoidance`.
        moving: a faster reference counts as moving, m/s or rad/s.
    """

    moving = MOVING

    def __init__(self, robot: Robot, avoidance: Avoidance) -> None:
        self._robot, self._avoidance, self._named = robot, avoidance, ("",) * robot.n
        # A joint without a limit gets the largest limit of the other joints.
        limited = np.isfinite(robot.v_limit)
        self._fastest = np.where(limited, robot.v_limit, robot.v_limit[limited].max(initial=1.0))
        self.carried = carried(robot)
        self.velocity_margin = avoidance.velocity_margin
        self._observed = NOTHING
        self._pairs: _Pairs | None = None

    @property
    def arguments(self) -> PairMemory:
        """The arrays of the pairs that compiled functions receive."""
        return self._known.arguments

    @property
    def _known(self) -> _Pairs:
        if self._pairs is None:
            self.observe(NOTHING)
        assert self._pairs is not None
        return self._pairs

    @property
    def room(self) -> float:
        """The smallest difference, m, between the distance of a pair at the last tick and the distance that
        the pair must keep. Infinite if no pair was within `WITHIN`."""
        return math.inf if self._pairs is None else float(self._pairs.f["about"][ROOM])

    @property
    def moves(self) -> bool:
        """Whether an object with a row moves."""
        return self._pairs is not None and bool(self._pairs.f["about"][FASTEST] > MOVING)

    def change(self, avoidance: Avoidance) -> None:
        """Takes other numbers, and forgets the distances of the last tick."""
        before, self._avoidance, self.velocity_margin = self._avoidance, avoidance, avoidance.velocity_margin
        if self._pairs is not None:
            self._pairs.f["about"][[ROOM, FASTEST]] = math.inf, 0.0
            if avoidance != before:
                self._write_numbers(self._pairs, len(self._observed.shapes))

    def _write_numbers(self, pairs: _Pairs, objects: int) -> None:
        avoidance, f = self._avoidance, pairs.f
        kept = avoidance.d_safe + avoidance.margin
        f["shares"][:] = 1.0
        if kept > 0.0:
            f["shares"][objects:] = np.minimum(1.0, _links(self._robot).kept / kept)
        f["numbers"][:] = avoidance.d_safe, avoidance.margin, avoidance.reaction, avoidance.deceleration

    def observe(self, observed: Observed) -> None:
        """Stores the present placements and velocities of the objects."""
        before, self._observed, B = self._observed, observed, len(observed.shapes)
        pairs = self._pairs
        if pairs is None or before.shapes != observed.shapes:
            if pairs is not None and list(map(_kind, observed.shapes)) == list(map(_kind, before.shapes)):
                pairs.f["turn"][:B], pairs.f["middle"][:B] = placements(observed.shapes)
            else:
                pairs = self._pairs = self._know(observed)
        pairs.f["velocity"][:B] = 0.0 if observed.velocity is None else observed.velocity

    def _know(self, observed: Observed) -> _Pairs:
        """Prepares the arrays for a new set of objects."""
        robot = self._robot
        around = cover_surroundings(robot, cover_of(robot), observed.shapes)
        objects = len(observed.shapes)
        around.meets[objects:] = _links(robot).meets
        pairs = _Pairs(geometry(robot), around, row_count(robot.n))
        pairs.f["fastest"][:] = self._fastest
        self._write_numbers(pairs, objects)
        self._named = ("",) * robot.n
        self._names = [[f"{link} – {name}" for link in around.links] for name in around.names]
        return pairs

    def _name(self) -> tuple[str, ...]:
        """Returns the name of the pair of each row, (n,); empty where there is none."""
        f, i = self._known.f, self._known.i
        if f["about"][CHANGED]:
            at = zip(i["other"].tolist(), i["link"].tolist(), strict=True)
            names = [self._names[other][link] for other, link in at if other >= 0]
            self._named = (*names, *[""] * (self._robot.n - len(names)))
        return self._named

    def at(self, q: Array, observed: Observed) -> Near:
        """Returns the nearest pairs at the positions q, (n,)."""
        self.observe(observed)
        count = chosen_pairs(*self.arguments, q)
        f, chosen = self._known.f, self._known.i["chosen"][:count]
        moving, share = f["moving"][:count].copy(), f["share"][:count].copy()
        return Near(f["distance"][chosen], f["slopes"][chosen], moving, share, self._name()[:count])

    def write(self, arena: Arena, block: int) -> tuple[str, ...]:
        """Writes the rows of this tick to an arena that holds the measured state; returns the name of each
        row's pair, (n,).

        block: index of the set of directions for distances.
        """
        distance_rows(*arena.arguments, *self.arguments, block)
        return self._name()


class Anywhere(NamedTuple):
    """Stands for the distances of a controller that keeps none: an obstacle may be near at any time.

    Attributes:
        carried, velocity_margin, room, moves, moving: as for `Distances`.
    """

    carried: Array
    velocity_margin: float
    room: float = 0.0
    moves: bool = False
    moving: float = MOVING_ANYWHERE


def _kind(shape: WorldShape) -> tuple[object, ...]:
    """Returns the data of a shape that stay constant when the object moves."""
    fixed = (value for name, value in vars(shape).items() if name not in ("centre", "foot", "yaw"))
    return type(shape), *fixed

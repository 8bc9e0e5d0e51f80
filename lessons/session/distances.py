"""The objects around a robot as they are reported to a controller, and their distances for telemetry."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from himpc.htmpc import HTMPCSettings
from himpc.htmpc.clearance import CollisionModel
from himpc.limits.limits import Avoidance
from himpc.references.outlook import Observed
from himpc.tick.distances import Distances
from robots import Plant, Robot
from robots.arrays import Array
from robots.collision import Ball, Box, Floor, Obstacle
from robots.world import Post, Thing


def objects_of(plant: Plant) -> Observed:
    """Returns the objects of a plant's world at their present places. A free box or post counts as
    upright."""
    shapes, moving = [thing.shape for thing in plant.world], plant.object_velocities()
    if not len(moving):
        return Observed(tuple(shapes))
    poses, velocities = iter(plant.objects()), iter(moving)
    velocity = np.zeros((len(plant.world), 3))
    for index, thing in enumerate(plant.world):
        if thing.free:
            shapes[index], velocity[index] = _moved(thing, next(poses)), next(velocities)
    return Observed(tuple(shapes), velocity)


def _moved(thing: Thing, pose: np.ndarray) -> Ball | Box | Post | Floor:
    x, y, z, w, _, _, k = pose.tolist()
    match thing.shape:
        case Ball() as ball:
            return replace(ball, centre=(x, y, z))
        case Box() as box:
            return replace(box, centre=(x, y, z), yaw=2.0 * float(np.arctan2(k, w)))
        case Post() as post:
            return replace(post, foot=(x, y, z - 0.5 * post.height))
        case Floor() as floor:
            return floor


EVERY = 5
"""Ticks between two measurements."""


class Nearest(NamedTuple):
    """The nearest pair: its distance minus the distance that it must keep is the smallest of all pairs.

    Attributes:
        distance: m, negative if the two penetrate each other; NaN if no pair is near.
        kept: the distance that the pair must keep, d_safe plus its margin, m; NaN unless distances are kept.
        pair: the names of its two members.
    """

    distance: float = math.nan
    kept: float = math.nan
    pair: str = ""


NO_PAIR = Nearest()


class Clearance:
    """Measures the nearest pair from the plant's true state, for every controller. Nothing is measured unless
    distances are kept or the world has more than a floor."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._furnished = any(not isinstance(thing.shape, Floor) for thing in plant.world)
        self._measures: tuple[Avoidance, Distances] | None = None
        self.nearest, self._due = NO_PAIR, 0

    def reset(self) -> None:
        """Begins a new run."""
        self.nearest, self._due = NO_PAIR, 0

    def measure(self, q: Array, avoidance: Avoidance) -> tuple[float, float]:
        """Returns the distance of the nearest pair and the distance that it must keep, m, measured every
        EVERY ticks.

        q: (n,) true positions.
        """
        if not (avoidance.on or self._furnished):
            return math.nan, math.nan
        if self._due == 0:
            self.nearest = self._look(q, avoidance) if math.isfinite(q.dot(q)) else NO_PAIR
        self._due = (self._due + 1) % EVERY
        return self.nearest.distance, self.nearest.kept

    def _look(self, q: Array, avoidance: Avoidance) -> Nearest:
        if self._measures is None or self._measures[0] != avoidance:
            self._measures = avoidance, Distances(self._plant.robot, avoidance)
        near = self._measures[1].at(q, objects_of(self._plant))
        if not len(near.distance):
            return NO_PAIR
        kept = near.share * (avoidance.d_safe + avoidance.margin)
        first = int(np.argmin(near.distance - kept))
        bound = float(kept[first]) if avoidance.on else math.nan
        return Nearest(float(near.distance[first]), bound, near.names[first])


WITHIN = 1.0
"""m: obstacles farther away than this are not measured."""


class ObstacleDistances:
    """Measures the distance to the nearest obstacle, for every controller."""

    def __init__(self, robot: Robot, settings: HTMPCSettings) -> None:
        """settings: contain the obstacles at their true places."""
        self._robot, self._self_collision = robot, settings.self_collision
        self._obstacles = self._reported = settings.obstacles
        self._true = self._assumed = CollisionModel(robot, settings.obstacles, settings.self_collision)

    def tell(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Sets the reported obstacles, which may differ from the true ones."""
        if obstacles == self._reported:
            return
        self._reported = obstacles
        same = obstacles == self._obstacles
        self._assumed = self._true if same else CollisionModel(self._robot, obstacles, self._self_collision)

    def at(self, q: Array) -> Array:
        """Distances to the nearest true and to the nearest reported obstacle, (2,) m; negative inside,
        infinite if none is within WITHIN. q: (n,), the true positions."""
        true = _least(self._true, q)
        return np.array([true, true if self._assumed is self._true else _least(self._assumed, q)])


def _least(model: CollisionModel, q: Array) -> float:
    if model.empty:
        return math.inf
    near = model.clearances(q[None], WITHIN, gradients=False)
    return float(near.distance.min(initial=math.inf))

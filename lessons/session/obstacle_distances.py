"""The distances at velocity level between a robot and its obstacles, at their true and at their reported
places."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc import HTMPCSettings
from himpc.htmpc.clearance import CollisionModel
from robots import Robot
from robots.collision import Obstacle

Array = NDArray[np.float64]

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

"""The distance of the nearest pair among a robot's links and the objects around it, for telemetry."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.limits.avoidance import Avoidance
from himpc.tick.distances import Distances
from lessons.session.observed import objects_of
from robots import Plant
from robots.collision import Floor

Array = NDArray[np.float64]

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


NOTHING = Nearest()


class Clearance:
    """Measures the nearest pair from the plant's true state, for every controller. Nothing is measured unless
    distances are kept or the world has more than a floor."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._furnished = any(not isinstance(thing.shape, Floor) for thing in plant.world)
        self._measures: tuple[Avoidance, Distances] | None = None
        self.nearest, self._due = NOTHING, 0

    def reset(self) -> None:
        """Begins a new run."""
        self.nearest, self._due = NOTHING, 0

    def measure(self, q: Array, avoidance: Avoidance) -> tuple[float, float]:
        """Returns the distance of the nearest pair and the distance that it must keep, m, measured every
        EVERY ticks.

        q: (n,) true positions.
        """
        if not (avoidance.on or self._furnished):
            return math.nan, math.nan
        if self._due == 0:
            self.nearest = self._look(q, avoidance) if math.isfinite(q.dot(q)) else NOTHING
        self._due = (self._due + 1) % EVERY
        return self.nearest.distance, self.nearest.kept

    def _look(self, q: Array, avoidance: Avoidance) -> Nearest:
        if self._measures is None or self._measures[0] != avoidance:
            self._measures = avoidance, Distances(self._plant.robot, avoidance)
        near = self._measures[1].at(q, objects_of(self._plant))
        if not len(near.distance):
            return NOTHING
        kept = near.share * (avoidance.d_safe + avoidance.margin)
        first = int(np.argmin(near.distance - kept))
        bound = float(kept[first]) if avoidance.on else math.nan
        return Nearest(float(near.distance[first]), bound, near.names[first])

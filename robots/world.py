"""The objects of a scene that a robot can touch: floor, table, posts, balls and boxes, static or free."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Annotated

from robots.collision import Ball, Box, Floor, Post, WorldShape
from robots.errors import InputError
from robots.ranges import Range, check_fields

MOST = 50
"""Largest number of objects of a world. Each object increases the computing time of every step of the
plant."""
_TABLE_TOP = 0.04  # m, thickness


@dataclass(frozen=True)
class Thing:
    """An object of a world.

    Attributes:
        shape: the object's shape, initial position and name, which is unique in the world.
        mass_kg: mass of an object that moves freely, kg; None: the object is static. A floor is static.
        friction: coefficient of sliding friction between the object and the robot.
    """

    shape: WorldShape
    mass_kg: Annotated[float | None, Range(1e-3, 1e3)] = None
    friction: Annotated[float, Range(0.0, 10.0)] = 0.5

    def __post_init__(self) -> None:
        check_fields(self, f"object '{self.shape.name}': ")
        if isinstance(self.shape, Floor) and self.mass_kg is not None:
            raise InputError(f"the floor '{self.shape.name}' has a mass: leave it out, a floor is static")

    @property
    def free(self) -> bool:
        """Whether the object moves freely."""
        return self.mass_kg is not None

    @property
    def pose(self) -> tuple[float, ...]:
        """Position of the middle, m, and quaternion (w, x, y, z), both at the start."""
        yaw = 0.0
        match self.shape:
            case Ball(_, centre):
                x, y, z = centre
            case Box(_, centre, _, yaw):
                x, y, z = centre
            case Post(_, (x, y, foot), height):
                z = foot + 0.5 * height
            case Floor(_, z):
                x = y = 0.0
        return x, y, z, math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)


World = tuple[Thing, ...]


def check_world(world: World) -> None:
    """Raises InputError for a world with too many objects or with two of the same name."""
    if len(world) > MOST:
        raise InputError(f"the world has {len(world)} objects; give at most {MOST}.")
    twice = [name for name, count in Counter(thing.shape.name for thing in world).items() if count > 1]
    if twice:
        raise InputError(f"two objects of the world are called '{twice[0]}'; give each its own name.")


def table(name: str, centre: tuple[float, float], size: tuple[float, float], height: float) -> Thing:
    """Returns a static table, from the middle and the edge lengths of its top and the height of its surface,
    m."""
    (x, y), (length, width) = centre, size
    return Thing(Box(name, (x, y, height - 0.5 * _TABLE_TOP), (length, width, _TABLE_TOP)))

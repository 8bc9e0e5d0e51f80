"""Geometry for collision avoidance as arrays: the obstacles, and the spheres that approximate the robot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robots.errors import InputError
from robots.robot import Robot
from robots.spheres import covering_spheres

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Point = tuple[float, float, float]
FLOOR, BALL, BOX, CAPSULE = range(4)
"""Kinds of shapes."""


@dataclass(frozen=True)
class Ball:
    """A ball in the world: centre and radius, m."""

    name: str
    centre: Point
    radius: float

    def __post_init__(self) -> None:
        _check(self.name, self.centre, self.radius)


@dataclass(frozen=True)
class Box:
    """A box in the world: centre and edge lengths, m, rotated about the vertical by yaw, rad."""

    name: str
    centre: Point
    size: Point
    yaw: float = 0.0

    def __post_init__(self) -> None:
        _check(self.name, (*self.centre, self.yaw), *self.size)


@dataclass(frozen=True)
class Floor:
    """Everything below a height, m. The spheres of a mobile base, which stands on the floor, are not
    checked."""

    name: str = "floor"
    height: float = 0.0

    def __post_init__(self) -> None:
        _check(self.name, (self.height,))


Obstacle = Ball | Box | Floor


def _check(name: str, numbers: tuple[float, ...], *sizes: float) -> None:
    if not all(math.isfinite(x) for x in (*numbers, *sizes)) or not all(size > 0 for size in sizes):
        raise InputError(f"obstacle '{name}' needs finite coordinates and sizes above 0")


class Surroundings(NamedTuple):
    """Arrays of the capsules s of a robot (spheres, if their spans are 0) and of the shapes o that the robot
    must not touch.

    Attributes:
        links: names of the links that carry the capsules.
        joint: (S,) index of the joint that carries each capsule. centre: (S, 3) m, the start of its segment
            in that joint's axes. span: (S, 3) m, from the start to the end. radius: (S,) m.
        names: names of the shapes.
        kind: (O,) FLOOR, BALL, BOX or CAPSULE.
        carrier: (O,) index of the joint that carries each shape, 0 for the world.
        turn: (O, 3, 3) and middle: (O, 3) m, axes and middle of the shape in the axes of its carrier. For a
            floor, the middle is a point of its surface; for a capsule, the start of its segment.
        half: (O, 3) m, half the edges of a box; for a ball, the first number is its radius; for a capsule,
            its segment in the axes of its carrier. thickness: (O,) m, a capsule's radius.
        meets: (O, S) whether the distance of a pair is checked.
    """

    links: tuple[str, ...]
    joint: Indices
    centre: Array
    span: Array
    radius: Array
    names: tuple[str, ...]
    kind: Indices
    carrier: Indices
    turn: Array
    middle: Array
    half: Array
    thickness: Array
    meets: NDArray[np.bool_]


class _Shape(NamedTuple):
    name: str
    kind: int
    carrier: int
    yaw: float
    middle: Array
    half: Array
    meets: NDArray[np.bool_]


def surroundings(robot: Robot, obstacles: tuple[Obstacle, ...], self_collision: bool = False) -> Surroundings:
    """Collects the spheres of a robot and the shapes that they must not touch: the obstacles, and for the
    arm's spheres the robot's own base."""
    spheres = covering_spheres(robot)
    frames = [robot.model.frames[robot.frame_id(sphere.link)] for sphere in spheres]
    joint = np.array([frame.parentJoint for frame in frames], np.intp)
    centre = [frame.placement.act(np.array(one.centre)) for frame, one in zip(frames, spheres, strict=True)]
    radius = np.array([sphere.radius for sphere in spheres])
    base = base_joint(robot)
    shapes = [_shape(obstacle, joint, base) for obstacle in obstacles]
    if self_collision and base:
        shapes.append(_own_base(base, joint, np.array(centre), radius))
    return Surroundings(
        links=tuple(sphere.link for sphere in spheres),
        joint=joint,
        centre=np.array(centre),
        span=np.zeros((len(spheres), 3)),
        radius=radius,
        names=tuple(shape.name for shape in shapes),
        kind=np.array([shape.kind for shape in shapes], np.intp),
        carrier=np.array([shape.carrier for shape in shapes], np.intp),
        turn=np.array([pin.rpy.rpyToMatrix(0.0, 0.0, shape.yaw) for shape in shapes]).reshape(-1, 3, 3),
        middle=np.array([shape.middle for shape in shapes]).reshape(-1, 3),
        half=np.array([shape.half for shape in shapes]).reshape(-1, 3),
        thickness=np.zeros(len(shapes)),
        meets=np.array([shape.meets for shape in shapes], np.bool_).reshape(-1, len(spheres)),
    )


def base_joint(robot: Robot) -> int:
    """Returns the index of the last joint of a mobile base, which unbounded joints move over the floor; 0 for
    a robot without one. Bodies up to that joint stand on the floor."""
    free = np.isinf(robot.q_lower) & np.isinf(robot.q_upper)
    return max((robot.joints[j - 1] for j in range(3, robot.n + 1) if free[:j].all()), default=0)


def _shape(obstacle: Obstacle, joint: Indices, base: int) -> _Shape:
    every = np.ones(len(joint), np.bool_)
    if isinstance(obstacle, Floor):
        surface = np.array([0.0, 0.0, obstacle.height])
        return _Shape(obstacle.name, FLOOR, 0, 0.0, surface, np.zeros(3), joint > base)
    middle = np.array(obstacle.centre, float)
    if isinstance(obstacle, Ball):
        return _Shape(obstacle.name, BALL, 0, 0.0, middle, np.full(3, obstacle.radius), every)
    return _Shape(obstacle.name, BOX, 0, obstacle.yaw, middle, 0.5 * np.array(obstacle.size, float), every)


def _own_base(base: int, joint: Indices, centre: Array, radius: Array) -> _Shape:
    """Returns the base as a box around its spheres. The links next to the base are not checked against the
    box."""
    own = joint == base
    low = (centre[own] - 0.6 * radius[own, None]).min(axis=0)
    high = (centre[own] + 0.6 * radius[own, None]).max(axis=0)
    return _Shape("base", BOX, base, 0.0, 0.5 * (low + high), 0.5 * (high - low), joint > base + 2)

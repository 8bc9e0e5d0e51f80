"""The shapes around a robot, the spheres that approximate it under HTMPC, and both as arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from robots.arrays import Array, Indices, Mask
from robots.errors import InputError
from robots.geometry import Point, point
from robots.joints import chain_length
from robots.robot import Robot

FLOOR, BALL, BOX, CAPSULE = range(4)
"""Kinds of shapes."""


@dataclass(frozen=True)
class Ball:
    """A ball in the world: centre and radius, m."""

    name: str
    centre: Point
    radius: float

    def __post_init__(self) -> None:
        _check("obstacle", self.name, self.centre, self.radius)


@dataclass(frozen=True)
class Box:
    """A box in the world: centre and edge lengths, m, rotated about the vertical by yaw, rad."""

    name: str
    centre: Point
    size: Point
    yaw: float = 0.0

    def __post_init__(self) -> None:
        _check("obstacle", self.name, (*self.centre, self.yaw), *self.size)


@dataclass(frozen=True)
class Floor:
    """Everything below a height, m. The spheres of a mobile base, which stands on the floor, are not
    checked."""

    name: str = "floor"
    height: float = 0.0

    def __post_init__(self) -> None:
        _check("obstacle", self.name, (self.height,))


@dataclass(frozen=True)
class Post:
    """An upright cylinder: the middle of its lower end, its height and its radius, m."""

    name: str
    foot: Point
    height: float
    radius: float

    def __post_init__(self) -> None:
        _check("post", self.name, self.foot, self.height, self.radius)


Obstacle = Ball | Box | Floor
WorldShape = Ball | Box | Post | Floor


def _check(what: str, name: str, numbers: tuple[float, ...], *sizes: float) -> None:
    if not all(math.isfinite(x) for x in (*numbers, *sizes)) or not all(size > 0 for size in sizes):
        raise InputError(f"{what} '{name}' needs finite coordinates and sizes above 0")


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
    meets: Mask


class ShapeArrays(NamedTuple):
    """The rows of `Surroundings` that describe shapes of the world: kind, turn, middle, half, thickness."""

    kind: Indices
    turn: Array
    middle: Array
    half: Array
    thickness: Array


def shape_arrays(shapes: Sequence[WorldShape]) -> ShapeArrays:
    """Returns shapes as arrays. Those of a post describe the capsule that contains it."""
    tables = [_table(shape) for shape in shapes]
    turns = [pin.rpy.rpyToMatrix(0.0, 0.0, yaw) for _, yaw, *_ in tables]
    return ShapeArrays(
        np.array([kind for kind, *_ in tables], np.intp),
        np.array(turns).reshape(-1, 3, 3),
        np.array([middle for _, _, middle, *_ in tables]).reshape(-1, 3),
        np.array([half for *_, half, _ in tables]).reshape(-1, 3),
        np.array([thickness for *_, thickness in tables], float),
    )


def _table(shape: WorldShape) -> tuple[int, float, Array, Array, float]:
    """Returns kind, yaw, middle, half and thickness, see `Surroundings`."""
    none = np.zeros(3)
    match shape:
        case Floor(_, height):
            return FLOOR, 0.0, np.array([0.0, 0.0, height]), none, 0.0
        case Ball(_, centre, radius):
            return BALL, 0.0, np.array(centre, float), np.full(3, radius), 0.0
        case Box(_, centre, size, yaw):
            return BOX, yaw, np.array(centre, float), 0.5 * np.array(size, float), 0.0
        case Post(_, foot, height, radius):
            return CAPSULE, 0.0, np.array(foot, float), np.array([0.0, 0.0, height]), radius


def surroundings(robot: Robot, obstacles: tuple[Obstacle, ...], self_collision: bool = False) -> Surroundings:
    """Collects the spheres of a robot and the shapes that they must not touch: the obstacles, and for the
    arm's spheres the robot's own base."""
    spheres = covering_spheres(robot)
    frames = [robot.model.frames[robot.frame_id(sphere.link)] for sphere in spheres]
    joint = np.array([frame.parentJoint for frame in frames], np.intp)
    centre = np.array(
        [frame.placement.act(np.array(one.centre)) for frame, one in zip(frames, spheres, strict=True)]
    )
    radius = np.array([sphere.radius for sphere in spheres])
    base, shapes = base_joint(robot), list(obstacles)
    every = np.ones(len(joint), np.bool_)
    meets = [joint > base if isinstance(obstacle, Floor) else every for obstacle in obstacles]
    carrier = [0] * len(obstacles)
    if self_collision and base:
        shapes.append(_own_base(joint == base, centre, radius))
        meets.append(joint > base + 2)  # the links next to the base are not checked against it
        carrier.append(base)
    kind, turn, middle, half, thickness = shape_arrays(shapes)
    return Surroundings(
        links=tuple(sphere.link for sphere in spheres),
        joint=joint,
        centre=centre,
        span=np.zeros((len(spheres), 3)),
        radius=radius,
        names=tuple(shape.name for shape in shapes),
        kind=kind,
        carrier=np.array(carrier, np.intp),
        turn=turn,
        middle=middle,
        half=half,
        thickness=thickness,
        meets=np.array(meets, np.bool_).reshape(-1, len(spheres)),
    )


def _own_base(own: Mask, centre: Array, radius: Array) -> Box:
    """Returns a box around the base's own spheres, in the axes of the base."""
    low = (centre[own] - 0.6 * radius[own, None]).min(axis=0)
    high = (centre[own] + 0.6 * radius[own, None]).max(axis=0)
    (x, y, z), (length, width, height) = (0.5 * (low + high)).tolist(), (high - low).tolist()
    return Box("base", (x, y, z), (length, width, height))


def base_joint(robot: Robot) -> int:
    """Returns the index of the last joint of a mobile base, which unbounded joints move over the floor; 0 for
    a robot without one. Bodies up to that joint stand on the floor."""
    free = np.isinf(robot.q_lower) & np.isinf(robot.q_upper)
    return max((robot.joints[j - 1] for j in range(3, robot.n + 1) if free[:j].all()), default=0)


class Sphere(NamedTuple):
    """A ball fixed to a link: centre in the link's frame, m, and radius, m."""

    link: str
    centre: Point
    radius: float


def _row(link: str, points: tuple[Point, ...], radius: float) -> tuple[Sphere, ...]:
    return tuple(Sphere(link, point, radius) for point in points)


_RIDGEBACK_UR10 = (
    # The chassis, 0.96 × 0.793 × 0.31 m, in 3 × 2 cells; the column; the arm's links along their axes.
    *_row("base", tuple((x, y, 0.17) for x in (-0.32, 0.0, 0.32) for y in (-0.198, 0.198)), 0.30),
    *_row("base", ((0.27, 0.01, 0.42), (0.27, 0.01, 0.60)), 0.18),
    *_row("upper_arm", tuple((x, 0.0, 0.19) for x in (0.0, -0.2, -0.4, -0.6)), 0.10),
    *_row("forearm", tuple((x, 0.0, 0.049) for x in (-0.15, -0.3, -0.45)), 0.08),
    *_row("wrist_1", ((0.0, 0.0, 0.049), (0.0, 0.0, 0.14)), 0.07),
    *_row("wrist_3", ((0.0, 0.0, 0.0), (0.0, 0.0, 0.1)), 0.07),
    *_row("tool", ((0.0, 0.0, -0.19), (0.0, 0.0, -0.1), (0.0, 0.0, 0.0)), 0.05),
)
_BY_ROBOT = {"ridgeback-ur10": _RIDGEBACK_UR10}
_SLENDER = 0.05
"""Radius divided by the length of the whole chain, for robots whose spheres are generated."""


def covering_spheres(robot: Robot) -> tuple[Sphere, ...]:
    """Returns the spheres of a robot. Those of the catalog's mobile manipulator were placed by hand; for
    other robots they are generated along the links.

    Generated spheres lie on the straight lines from each joint to the next one and to the tip. The distance
    between neighbouring spheres equals their radius, which is a twentieth of the chain's length. The spheres
    approximate the links, as in the HTMPC paper: parts of the links stand out of the spheres. Distances at
    torque level use the capsules of `robots.covering.cover_of`, which contain the links.
    """
    return _BY_ROBOT.get(robot.name) or _along_links(robot)


def _along_links(robot: Robot) -> tuple[Sphere, ...]:
    model = robot.model
    tip = model.frames[robot.frame_id(robot.tip)]
    chain = [joint for joint in model.supports[tip.parentJoint] if joint > 0]
    ends = [np.asarray(model.jointPlacements[joint].translation) for joint in chain[1:]]
    ends.append(np.asarray(tip.placement.translation))
    radius = _SLENDER * max(chain_length(model, robot.frame_id(robot.tip)), 0.05)
    spheres: list[Sphere] = []
    for joint, end in zip(chain, ends, strict=True):
        link = next((n for n in robot.frames if model.frames[robot.frame_id(n)].parentJoint == joint), None)
        if link is None:
            continue
        inverse = model.frames[robot.frame_id(link)].placement.inverse()
        steps = max(1, int(np.ceil(float(np.linalg.norm(end)) / radius)))
        for k in range(1, steps + 1):
            spheres.append(Sphere(link, point(inverse.act(end * (k / steps))), radius))
    return tuple(spheres)

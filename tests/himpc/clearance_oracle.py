"""The reference for the clearances: a collision library computes the same distances, pair by pair."""

# pyright: reportAttributeAccessIssue=false
# coal is a compiled module without type information.

from __future__ import annotations

import math
from typing import NamedTuple

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robots import Robot
from robots.collision import Ball, Floor, Obstacle, covering_spheres

Array = NDArray[np.float64]


_EYE = np.eye(3)
_NOWHERE = np.zeros(3)


class Touched(NamedTuple):
    """Distances between the nearest pairs at all knots.

    Attributes:
        knot: (r,) index of the configuration.
        distance: (r,) m, negative if the shapes penetrate.
        gradient: (r, n) of the distance with respect to q, m/rad.
        pairs: (link of the sphere, name of the obstacle) of each.
    """

    knot: NDArray[np.int64]
    distance: Array
    gradient: Array
    pairs: list[tuple[str, str]]


class _Pair(NamedTuple):
    name: str
    shape: coal.CollisionGeometry
    placement: coal.Transform3s
    joint: int
    spheres: NDArray[np.int64]
    centre: Array
    reach: float
    height: float = 0.0


class _Touch(NamedTuple):
    knot: int
    distance: float
    joint: int
    carrier: int
    normal: Array
    here: Array
    there: Array


class _Placed(NamedTuple):
    """Positions of spheres and joints for every configuration."""

    centres: Array
    rotations: Array
    translations: Array
    J: Array


class Oracle:
    """Computes distances of a robot's spheres to obstacles, and of its arm's spheres to its own base.

    A coarse test with bounding balls selects the pairs whose exact distance is computed.
    """

    def __init__(self, robot: Robot, obstacles: tuple[Obstacle, ...], self_collision: bool = False) -> None:
        self._robot = robot
        self._data = robot.model.createData()
        spheres = covering_spheres(robot)
        frames = [robot.model.frames[robot.frame_id(sphere.link)] for sphere in spheres]
        self.links = tuple(sphere.link for sphere in spheres)
        self._joints = np.array([frame.parentJoint for frame in frames])
        centres = [
            frame.placement.act(np.array(sphere.centre))
            for frame, sphere in zip(frames, spheres, strict=True)
        ]
        self._local = np.array(centres)
        self._radius = np.array([sphere.radius for sphere in spheres])
        self._balls = [coal.Sphere(float(radius)) for radius in self._radius]
        self._moves = np.zeros((robot.n + 1, robot.n))
        for joint in range(1, robot.n + 1):
            self._moves[joint, [k - 1 for k in robot.model.supports[joint] if k > 0]] = 1.0
        # A mobile base is a body that several unbounded joints move over the floor.
        free = np.isinf(robot.q_lower) & np.isinf(robot.q_upper)
        mobile = [joint for joint in range(robot.n + 1) if joint > 2 and free[:joint].all()]
        base = max(mobile, default=0)
        self._pairs = [self._fixed(obstacle, base) for obstacle in obstacles]
        if self_collision and base:
            self._pairs.append(self._own_base(base))
        carriers = {*self._joints.tolist(), *(pair.joint for pair in self._pairs)}
        self._carriers = sorted(carriers)
        self._request = coal.DistanceRequest()

    @property
    def empty(self) -> bool:
        """Whether there are no pairs."""
        return not self._pairs

    def _fixed(self, obstacle: Obstacle, base: int) -> _Pair:
        every = np.arange(len(self._joints))
        if isinstance(obstacle, Floor):
            shape = coal.Halfspace(np.array([0.0, 0.0, 1.0]), obstacle.height)
            arm = every[self._joints > base]
            return _Pair(
                obstacle.name, shape, coal.Transform3s(), 0, arm, _NOWHERE, math.inf, obstacle.height
            )
        if isinstance(obstacle, Ball):
            shape, turn, reach = coal.Sphere(obstacle.radius), np.eye(3), obstacle.radius
        else:
            x, y, z = obstacle.size
            shape, turn = coal.Box(x, y, z), pin.rpy.rpyToMatrix(0.0, 0.0, obstacle.yaw)
            reach = 0.5 * math.sqrt(x * x + y * y + z * z)
        centre = np.array(obstacle.centre)
        return _Pair(obstacle.name, shape, coal.Transform3s(turn, centre), 0, every, centre, reach)

    def _own_base(self, base: int) -> _Pair:
        """Returns the own base as a box around its spheres; the links next to the base are not checked
        against it."""
        own = self._joints == base
        low = (self._local[own] - 0.6 * self._radius[own, None]).min(axis=0)
        high = (self._local[own] + 0.6 * self._radius[own, None]).max(axis=0)
        x, y, z = high - low
        centre = 0.5 * (low + high)
        far = np.flatnonzero(self._joints > base + 2)
        reach = 0.5 * float(np.linalg.norm(high - low))
        return _Pair("base", coal.Box(x, y, z), coal.Transform3s(np.eye(3), centre), base, far, centre, reach)

    def clearances(self, q: Array, within: float, gradients: bool = True) -> Touched:
        """Returns all pairs with a distance below `within`, m, at configurations q (K, n). Without gradients,
        the array of gradients is empty."""
        placed = self._kinematics(q, gradients)
        centres = placed.centres
        touches: list[_Touch] = []
        names: list[tuple[str, str]] = []
        result = coal.DistanceResult()
        for pair in self._pairs:
            for k, i in zip(*self._near(pair, placed, within), strict=True):
                result.clear()
                ball = coal.Transform3s(_EYE, centres[k, i])
                place = _placed(placed, pair, k)
                distance = coal.distance(self._balls[i], ball, pair.shape, place, self._request, result)
                if distance > within:
                    continue
                names.append((self.links[i], pair.name))
                if gradients:
                    here, there = np.array(result.getNearestPoint1()), np.array(result.getNearestPoint2())
                    touches.append(
                        _Touch(k, distance, self._joints[i], pair.joint, np.array(result.normal), here, there)
                    )
                else:
                    touches.append(_Touch(k, distance, 0, 0, _NOWHERE, _NOWHERE, _NOWHERE))
        knots = np.array([touch.knot for touch in touches], np.int64)
        distances = np.array([touch.distance for touch in touches], np.float64)
        slopes = self._slopes(touches, placed.J) if gradients else np.empty((0, self._robot.n))
        return Touched(knots, distances, slopes, names)

    def _kinematics(self, q: Array, gradients: bool) -> _Placed:
        model, data = self._robot.model, self._data
        rotations = np.empty((len(q), model.njoints, 3, 3))
        translations = np.empty((len(q), model.njoints, 3))
        J = np.empty((len(q), 6, model.nv))
        for k, configuration in enumerate(q):
            if gradients:
                J[k] = pin.computeJointJacobians(model, data, configuration)
            else:
                pin.forwardKinematics(model, data, configuration)
            for joint in self._carriers:
                placement = data.oMi[joint]
                rotations[k, joint], translations[k, joint] = placement.rotation, placement.translation
        turned = (rotations[:, self._joints] @ self._local[:, :, None])[..., 0]
        return _Placed(turned + translations[:, self._joints], rotations, translations, J)

    def _near(self, pair: _Pair, placed: _Placed, within: float) -> tuple[list[int], list[int]]:
        """Returns the knots and spheres whose bounding balls are near enough."""
        centres, radius = placed.centres[:, pair.spheres], self._radius[pair.spheres]
        if math.isinf(pair.reach):
            near = centres[..., 2] - radius < within + pair.height
        else:
            middle = pair.centre
            if pair.joint:
                middle = placed.rotations[:, pair.joint] @ middle + placed.translations[:, pair.joint]
                middle = middle[:, None]
            away = centres - middle
            near = np.sqrt((away * away).sum(axis=-1)) - radius - pair.reach < within
        knots, spheres = np.nonzero(near)
        return knots.tolist(), pair.spheres[spheres].tolist()

    def _slopes(self, touches: list[_Touch], J: Array) -> Array:
        """Returns ∂distance/∂q, (r, n): the normal, from the obstacle to the sphere, times the Jacobian of
        the relative motion."""
        if not touches:
            return np.empty((0, self._robot.n))
        normal = -np.array([touch.normal for touch in touches])
        J = J[[touch.knot for touch in touches]]
        slope = self._along(normal, np.array([touch.here for touch in touches]), J)
        slope = slope * self._moves[[touch.joint for touch in touches]]
        carriers = [touch.carrier for touch in touches]
        if any(carriers):
            other = self._along(normal, np.array([touch.there for touch in touches]), J)
            slope = slope - other * self._moves[carriers]
        return slope

    @staticmethod
    def _along(normal: Array, point: Array, J: Array) -> Array:
        """Returns the velocity along a normal, per joint velocity, of a point that all joints move."""
        return np.einsum("ri,rij->rj", np.hstack([normal, np.cross(point, normal)]), J)


def _placed(placed: _Placed, pair: _Pair, k: int) -> coal.Transform3s:
    if not pair.joint:
        return pair.placement
    return (
        coal.Transform3s(placed.rotations[k, pair.joint], placed.translations[k, pair.joint]) * pair.placement
    )

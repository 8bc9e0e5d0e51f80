"""Makes the cover of a robot, and finds the pairs of bodies whose distance is not kept."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from robots.collision_model import Solid
from robots.cover import Capsule, Cover
from robots.covered import patches
from robots.covering import covering
from robots.mechanics.exclusions import collision_model
from robots.per_robot import per_robot
from robots.robot import Robot


@per_robot
def made_cover(robot: Robot, meshes: bool = True) -> Cover:
    """Makes the cover of a robot from its URDF and its solids. meshes: whether mesh files are read."""
    model = robot.model
    longest = max(len(support) for support in model.supports) - 1
    depth = {joint: (len(model.supports[joint]) - 1) / max(longest, 1) for joint in range(model.njoints)}
    capsules = covering(patches(robot, meshes), depth)
    return Cover(capsules, collision_model(robot, tuple(map(as_solid, capsules))).excluded)


def as_solid(capsule: Capsule) -> Solid:
    """A capsule of a cover as a solid of the plant."""
    start, end = np.array(capsule.start), np.array(capsule.end)
    length = float(np.linalg.norm(end - start))
    middle = tuple(float(x) for x in 0.5 * (start + end))
    if length < 1e-6:
        return Solid(capsule.joint, capsule.link, "sphere", "capsule", (capsule.radius,), middle)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), (end - start) / length)
    x, y, z, w = turn.coeffs()
    return Solid(
        capsule.joint,
        capsule.link,
        "capsule",
        "capsule",
        (capsule.radius, 0.5 * length),
        middle,
        (w, x, y, z),
    )

"""The spheres that approximate a robot for collision avoidance in HTMPC."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robots.robot import Robot


class Sphere(NamedTuple):
    """A ball fixed to a link: centre in the link's frame, m, and radius, m."""

    link: str
    centre: tuple[float, float, float]
    radius: float


def _row(link: str, points: tuple[tuple[float, float, float], ...], radius: float) -> tuple[Sphere, ...]:
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
    radius = _SLENDER * max(sum(float(np.linalg.norm(end)) for end in ends), 0.05)
    spheres: list[Sphere] = []
    for joint, end in zip(chain, ends, strict=True):
        link = next((n for n in robot.frames if model.frames[robot.frame_id(n)].parentJoint == joint), None)
        if link is None:
            continue
        inverse = model.frames[robot.frame_id(link)].placement.inverse()
        steps = max(1, int(np.ceil(float(np.linalg.norm(end)) / radius)))
        for k in range(1, steps + 1):
            x, y, z = inverse.act(end * (k / steps))
            spheres.append(Sphere(link, (float(x), float(y), float(z)), radius))
    return tuple(spheres)

"""The surfaces that a cover contains: triangles of the visual shapes and of the solids of the plant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from robots.arrays import Array
from robots.geometry import Solid
from robots.robot import Robot
from robots.shapes.collision_shapes import FARTHEST, SHAPES_PER_LINK, primitive
from robots.shapes.read import described_shapes, mesh_surfaces

_SECTIONS = 24  # number of sides of the polygon that replaces a circle
_MOST = 250_000  # largest number of triangles of a robot


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles of a link in the axes of its joint, (F, 3, 3) m. The solid consists of all balls whose
    middles are on the triangles; `swell` is the radius of the balls, m. It is 0 for a surface."""

    joint: int
    link: str
    corners: Array
    swell: float = 0.0


def patches(robot: Robot, meshes: bool = True) -> Iterator[Patch]:
    """Yields the surfaces of the solids and of the visual shapes of a robot, at most 250,000 triangles.

    meshes: whether mesh files are read. No content of the description or of a mesh file raises an error.
    """
    left = _MOST
    for patch in (*map(_of_solid, robot.collision.solids), *_visuals(robot, meshes)):
        near = np.abs(patch.corners).max(initial=0.0) < FARTHEST  # false for NaN
        if near and 0 < len(patch.corners) <= left:
            left -= len(patch.corners)
            yield patch


def _visuals(robot: Robot, meshes: bool) -> Iterator[Patch]:
    links = described_shapes(robot, "visuals").values()
    visuals = [visual for shapes in links for visual in shapes[:SHAPES_PER_LINK]]
    surfaces = mesh_surfaces(visuals) if meshes else {}
    for visual in visuals:
        solid = primitive(visual, "hull")
        if solid is not None:
            yield _of_solid(solid)
        for _, vertices, faces in surfaces.get(visual.mesh, ()):
            corners = _placed(vertices[faces] * visual.size, visual.at)
            yield Patch(visual.joint, visual.link, corners)


def _of_solid(solid: Solid) -> Patch:
    """Returns the surface of a solid. The triangles of a round solid contain the solid."""
    if solid.kind == "hull":
        corners, swell = _hull(np.array(solid.points)), 0.0
        return Patch(solid.joint, solid.link, corners, swell)
    if solid.kind in ("sphere", "capsule"):
        half = solid.size[1] if solid.kind == "capsule" else 0.0
        corners, swell = np.array([[(0.0, 0.0, -half), (0.0, 0.0, half), (0.0, 0.0, half)]]), solid.size[0]
    else:
        corners, swell = _hull(_box(solid) if solid.kind == "box" else _cylinder(solid)), 0.0
    w, x, y, z = solid.quaternion
    at = pin.SE3(pin.Quaternion(w, x, y, z).normalized().toRotationMatrix(), np.array(solid.position))
    return Patch(solid.joint, solid.link, _placed(corners, at), swell)


def _box(solid: Solid) -> Array:
    return np.array([np.multiply(solid.size, signs) for signs in np.ndindex(2, 2, 2)]) * 2.0 - solid.size


def _cylinder(solid: Solid) -> Array:
    radius, half = solid.size
    turns = 2.0 * np.pi * np.arange(_SECTIONS) / _SECTIONS
    radius /= np.cos(np.pi / _SECTIONS)  # the circle is inside the polygon
    return np.array([(radius * np.cos(t), radius * np.sin(t), z) for t in turns for z in (-half, half)])


def _hull(points: Array) -> Array:
    """Returns the triangles of the convex hull of points; none if the hull has no volume."""
    from scipy.spatial import ConvexHull, QhullError  # their import takes long, and only hulls need them

    try:
        return points[ConvexHull(points).simplices]
    except (QhullError, ValueError):
        return np.zeros((0, 3, 3))


def _placed(corners: Array, at: pin.SE3) -> Array:
    return corners @ at.rotation.T + at.translation

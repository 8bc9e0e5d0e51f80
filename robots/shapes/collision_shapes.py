"""Makes the solids of a robot: the collision shapes of its URDF, convex hulls of visual shapes for links
without collision shapes, and capsules along the kinematics for bodies without any shape."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np
import pinocchio as pin

from robots.geometry import Solid, SolidKind, Source, directions, point
from robots.robot import Robot
from robots.shapes.limbs import limbs
from robots.shapes.read import DescribedShape, described_shapes, mesh_surfaces
from robots.truth import pose

CORNERS = 96
"""Largest number of corners of a hull."""
_SPREAD = 40  # number of directions; a link's farthest points in these directions are corners of its hull
_NEAR = 1e-3  # largest distance by which a link may stand out of its hull, m
_HALVED = {"box": 0.5, "cylinder": (1.0, 0.5), "sphere": 1.0}
"""Factors that turn the size of a shape into the size of a solid."""
SHAPES_PER_LINK = 500  # largest number of shapes of a link that are read
_PER_LINK = 8
_PER_ROBOT = 120
FARTHEST = 1e3  # largest coordinate of a point in the axes of its joint, m
_THIN = 1e-3  # half the least thickness of a hull, m
_DIGITS = 4  # decimal places of a coordinate in m


@np.errstate(all="ignore")
def collision_solids(robot: Robot, meshes: bool = True) -> tuple[Solid, ...]:
    """Returns at most 120 solids of a robot, in the order of their joints; those of the base come last.

    meshes: whether mesh files are read.

    A link with more than eight shapes gets one hull around all of them. Shapes whose numbers or files cannot
    be used are left out. No content of the description or of a mesh file raises an error.
    """
    visuals, collisions = described_shapes(robot, "visuals"), described_shapes(robot, "collisions")
    chosen: list[tuple[list[DescribedShape], Source]] = [
        (collisions[link][:SHAPES_PER_LINK], "collision")
        if collisions[link]
        else (visuals[link][:SHAPES_PER_LINK], "hull")
        for link in visuals
    ]
    surfaces = mesh_surfaces(shape for shapes, _ in chosen for shape in shapes) if meshes else {}
    points = {
        mesh: np.concatenate([vertices for _, vertices, _ in pieces])
        for mesh, pieces in surfaces.items()
        if pieces
    }
    solids = [solid for shapes, source in chosen for solid in _of_link(shapes, source, points)]
    bare = set(range(robot.model.njoints)) - {solid.joint for solid in solids}
    solids = [*solids[:_PER_ROBOT], *_capsules(robot, bare)]
    return tuple(sorted(solids[:_PER_ROBOT], key=lambda solid: (solid.joint == 0, solid.joint)))


def _of_link(
    shapes: Sequence[DescribedShape], source: Source, points: Mapping[str, np.ndarray]
) -> list[Solid]:
    """Returns the solids of a link. points: those of each mesh file, (V, 3) m."""
    found: list[Solid] = []
    clouds: list[np.ndarray] = []
    for shape in shapes:
        solid = primitive(shape, source)
        if solid is not None:
            cloud = _corners(solid)
        elif shape.mesh in points:
            cloud = points[shape.mesh] * shape.size
        else:
            continue
        clouds.append(cloud @ shape.at.rotation.T + shape.at.translation)
        solid = solid or _hull(shape, source, clouds[-1:])
        found += [] if solid is None else [solid]
    if len(found) > _PER_LINK:
        whole = _hull(shapes[0], source, clouds)
        return [] if whole is None else [whole]
    return found


def _corners(solid: Solid) -> np.ndarray:
    """Returns points of a primitive in its own axes, (V, 3) m. Their hull is about the primitive."""
    if solid.kind == "box":
        return np.array(list(product(*((-half, half) for half in solid.size))))
    if solid.kind == "sphere":
        return solid.size[0] * _directions()
    radius, half = solid.size
    turns = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    return np.array([(radius * np.cos(t), radius * np.sin(t), z) for t in turns for z in (-half, half)])


def primitive(shape: DescribedShape, source: Source) -> Solid | None:
    """Returns a box, cylinder or sphere as a solid; None for a mesh or if a number is out of range."""
    if shape.kind == "mesh":
        return None
    size = (shape.size * _HALVED[shape.kind]).tolist()
    far = np.abs(shape.at.translation).max() > FARTHEST
    if far or not all(1e-5 < each < FARTHEST for each in size):
        return None
    return _placed(shape.joint, shape.link, shape.kind, source, size, shape.at)


def _placed(joint: int, link: str, kind: SolidKind, source: Source, size: list[float], at: pin.SE3) -> Solid:
    place = pose(at)
    x, y, z = (round(float(value), 6) for value in place["pos"])
    w, i, j, k = (round(float(value), 8) for value in place["quat"])
    return Solid(joint, link, kind, source, tuple(map(float, size)), (x, y, z), (w, i, j, k))


def _hull(shape: DescribedShape, source: Source, clouds: list[np.ndarray]) -> Solid | None:
    """Returns the convex hull of points in the axes of a shape's joint, or None without points. A flat hull
    gets a thickness of 2 mm."""
    cloud = np.concatenate([np.zeros((0, 3)), *clouds])
    cloud = cloud[(np.abs(cloud) < FARTHEST).all(axis=1)]
    if not len(cloud):
        return None
    from scipy.spatial import ConvexHull, QhullError  # it takes time to load, and only hulls need it

    middle = cloud.mean(axis=0)
    axes = np.linalg.svd(np.cov((cloud - middle).T) if len(cloud) > 1 else np.eye(3))[0]
    for axis in axes.T:
        if np.ptp(cloud @ axis) < 2 * _THIN:
            cloud = np.concatenate([cloud - _THIN * axis, cloud + _THIN * axis])
    try:
        cloud = cloud[ConvexHull(cloud).vertices]
        chosen = np.unique((cloud @ _directions().T).argmax(axis=0))
        # The farthest point outside is added repeatedly, until all points are near the hull or it has enough
        # corners.
        while len(chosen) < CORNERS:
            planes = ConvexHull(cloud[chosen]).equations
            outside = (cloud @ planes[:, :3].T + planes[:, 3]).max(axis=1)
            if outside.max() < _NEAR:
                break
            chosen = np.append(chosen, outside.argmax())
        corners = np.unique(np.round(cloud[chosen], _DIGITS), axis=0)
        corners = corners[ConvexHull(corners).vertices]
    except QhullError:
        return None
    return Solid(shape.joint, shape.link, "hull", source, points=tuple(map(point, corners)))


def _directions() -> np.ndarray:
    """Returns unit vectors (_SPREAD, 3): along the axes, and on a spiral over the sphere."""
    return np.concatenate([np.eye(3), -np.eye(3), directions(_SPREAD - 6)])


def _capsules(robot: Robot, bare: set[int]) -> Iterator[Solid]:
    model = robot.model
    drawn = set(range(model.njoints)) - bare
    for limb in limbs(model, robot.frame_id(robot.tip), drawn):
        length = float(np.linalg.norm(limb.end))
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), limb.end / length).toRotationMatrix()
        own = (f for f in robot.frames if model.frames[robot.frame_id(f)].parentJoint == limb.joint)
        link = next(own, f"body {limb.joint}")
        kind: SolidKind = "cylinder" if limb.joint == 0 else "capsule"
        at = pin.SE3(turn, 0.5 * limb.end)
        yield _placed(limb.joint, link, kind, "capsule", [limb.radius, 0.5 * length], at)

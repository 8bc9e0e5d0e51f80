"""Makes the solids of a robot: the collision shapes of its URDF, convex hulls of visual shapes for links
without collision shapes, and capsules along the kinematics for bodies without any shape."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import groupby, product

import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.geometry.collision_model import Point, Solid, SolidKind, Source
from robots.robot import Robot
from robots.shapes.limbs import limbs
from robots.truth import pose
from robots.urdf.read import Refusal, placement

CORNERS = 96
"""Largest number of corners of a hull."""
_SPREAD = 40  # number of directions; a link's farthest points in these directions are corners of its hull
_NEAR = 1e-3  # largest distance by which a link may stand out of its hull, m
_TAGS: tuple[tuple[str, Source], ...] = (("collision", "collision"), ("visual", "hull"))
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
    root = etree.fromstring(robot.urdf_text.encode())
    chosen: list[tuple[Element, Source]] = []
    for link in root.findall("link"):
        tag, source = next((each for each in _TAGS if link.find(each[0]) is not None), _TAGS[1])
        chosen.extend((shape, source) for shape in link.findall(tag)[:SHAPES_PER_LINK])
    files = (shape.find("geometry/mesh") for shape, _ in chosen)
    surfaces = _surfaces([mesh.get("filename", "") for mesh in files if mesh is not None] if meshes else [])
    solids: list[Solid] = []
    for name, shapes in groupby(chosen, lambda each: str(each[0].getparent().get("name"))):
        solids += _of_link(robot, name, list(shapes), surfaces)
    bare = set(range(robot.n + 1)) - {solid.joint for solid in solids}
    solids = [*solids[:_PER_ROBOT], *_capsules(robot, bare)]
    return tuple(sorted(solids[:_PER_ROBOT], key=lambda solid: (solid.joint == 0, solid.joint)))


def _of_link(
    robot: Robot, name: str, shapes: list[tuple[Element, Source]], meshes: Mapping[str, np.ndarray]
) -> list[Solid]:
    frame = robot.model.frames[robot.frame_id(name)]
    found: list[Solid] = []
    clouds: list[np.ndarray] = []
    for shape, source in shapes:
        geometry = shape.find("geometry")
        if geometry is None or len(geometry) == 0:
            continue
        try:
            at = frame.placement * placement(shape)
            solid = primitive(geometry[0], frame.parentJoint, name, source, at)
            cloud = _scaled(geometry[0], meshes) if solid is None else _corners(solid)
        except (ValueError, Refusal):
            continue
        clouds.append(cloud @ at.rotation.T + at.translation)
        solid = solid or _hull(frame.parentJoint, name, source, clouds[-1:])
        found += [] if solid is None else [solid]
    if len(found) > _PER_LINK:
        whole = _hull(frame.parentJoint, name, shapes[0][1], clouds)
        return [] if whole is None else [whole]
    return found


def _surfaces(uris: list[str]) -> dict[str, np.ndarray]:
    """Returns the points of mesh files, (V, 3) m."""
    if not uris:
        return {}
    from robots.meshes.surfaces import mesh_pieces  # it loads trimesh, which most descriptions do not need

    return {
        uri: np.concatenate([vertices for _, vertices, _ in pieces])
        for uri, pieces in mesh_pieces(uris).items()
        if pieces
    }


def _scaled(shape: Element, meshes: Mapping[str, np.ndarray]) -> np.ndarray:
    """Returns the points of the mesh that an element names, (V, 3) m. Raises ValueError for a scale that is
    not a number."""
    scale = np.broadcast_to([float(word) for word in shape.get("scale", "1 1 1").split()], 3)
    return meshes.get(shape.get("filename", ""), np.zeros((0, 3))) * scale


def _corners(solid: Solid) -> np.ndarray:
    """Returns points of a primitive in its own axes, (V, 3) m. Their hull is about the primitive."""
    if solid.kind == "box":
        return np.array(list(product(*((-half, half) for half in solid.size))))
    if solid.kind == "sphere":
        return solid.size[0] * _directions()
    radius, half = solid.size
    turns = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    return np.array([(radius * np.cos(t), radius * np.sin(t), z) for t in turns for z in (-half, half)])


def primitive(shape: Element, joint: int, link: str, source: Source, at: pin.SE3) -> Solid | None:
    """Returns a box, cylinder or sphere; None for a mesh. Raises ValueError for a size that is not a
    number."""
    sizes = {
        name: [float(word) for word in shape.get(name, "").split()] for name in ("size", "radius", "length")
    }
    kind: SolidKind
    if shape.tag == "box":
        kind, size = "box", [0.5 * each for each in np.broadcast_to(sizes["size"], 3)]
    elif shape.tag == "sphere":
        (radius,) = sizes["radius"]
        kind, size = "sphere", [radius]
    elif shape.tag == "cylinder":
        (radius,), (length,) = sizes["radius"], sizes["length"]
        kind, size = "cylinder", [radius, 0.5 * length]
    else:
        return None
    if not all(1e-5 < each < FARTHEST for each in size) or np.abs(at.translation).max() > FARTHEST:
        raise ValueError("a size is out of range")
    return _placed(joint, link, kind, source, size, at)


def _placed(joint: int, link: str, kind: SolidKind, source: Source, size: list[float], at: pin.SE3) -> Solid:
    place = pose(at)
    x, y, z = (round(float(value), 6) for value in place["pos"])
    w, i, j, k = (round(float(value), 8) for value in place["quat"])
    return Solid(joint, link, kind, source, tuple(map(float, size)), (x, y, z), (w, i, j, k))


def _hull(joint: int, link: str, source: Source, clouds: list[np.ndarray]) -> Solid | None:
    """Returns the convex hull of points in the joint's axes, or None without points. A flat hull gets a
    thickness of 2 mm."""
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
    points: list[Point] = [(float(x), float(y), float(z)) for x, y, z in corners]
    return Solid(joint, link, "hull", source, points=tuple(points))


def _directions() -> np.ndarray:
    """Returns unit vectors (_SPREAD, 3): along the axes, and on a spiral over the sphere."""
    k = np.arange(_SPREAD - 6) + 0.5
    z, turn = 1.0 - 2.0 * k / len(k), np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z**2)
    spiral = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])
    return np.concatenate([np.eye(3), -np.eye(3), spiral])


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

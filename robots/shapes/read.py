"""Reads the visual and collision shapes of a robot's description, with yourdfpy."""

from __future__ import annotations

from collections.abc import Iterable
from io import StringIO
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import pinocchio as pin

from robots.arrays import Array
from robots.per_robot import per_robot
from robots.robot import Robot

if TYPE_CHECKING:
    from robots.meshes.surfaces import Piece


class DescribedShape(NamedTuple):
    """A shape of a link.

    Attributes:
        link: the link's name. joint: Pinocchio index of the joint that carries it, 0 for the world.
        at: the shape's placement in the joint's axes.
        kind: the shape.
        size: the edges of a box (3,), (radius, length) of a cylinder, (radius,) of a sphere, m; the scale of
            a mesh (3,).
        mesh: name of a mesh's file.
        colour: (3,), 0 … 1; None: the shape has no colour of its own.
    """

    link: str
    joint: int
    at: pin.SE3
    kind: Literal["box", "cylinder", "sphere", "mesh"]
    size: Array
    mesh: str
    colour: Array | None


@per_robot
def described_shapes(robot: Robot, what: Literal["visuals", "collisions"]) -> dict[str, list[DescribedShape]]:
    """Returns the shapes of every link by its name. No mesh file is read."""
    from yourdfpy import URDF  # it loads trimesh, which a robot of the catalog needs only to be drawn

    description = URDF.load(StringIO(robot.urdf_text), build_scene_graph=False, load_meshes=False)
    return {
        link.name: [_shape(robot, link.name, shape) for shape in getattr(link, what)]
        for link in description.robot.links
    }


def _shape(robot: Robot, link: str, shape: Any) -> DescribedShape:
    frame = robot.model.frames[robot.frame_id(link)]
    origin = np.eye(4) if shape.origin is None else shape.origin
    # Of equally far points, the last digit decides which one becomes a corner of a hull: Pinocchio's counts.
    turn = pin.rpy.rpyToMatrix(pin.rpy.matrixToRpy(origin[:3, :3]))
    at = frame.placement * pin.SE3(turn, origin[:3, 3])
    box, cylinder, sphere, mesh = (getattr(shape.geometry, kind) for kind in _KINDS)
    if mesh is not None:
        kind, size = "mesh", np.broadcast_to(1.0 if mesh.scale is None else mesh.scale, 3)
    elif cylinder is not None:
        kind, size = "cylinder", np.array([cylinder.radius, cylinder.length])
    else:
        kind, size = ("box", box.size) if sphere is None else ("sphere", np.array([sphere.radius]))
    file = "" if mesh is None else mesh.filename
    colour = getattr(getattr(shape, "material", None), "color", None)
    return DescribedShape(
        link, frame.parentJoint, at, kind, size, file, None if colour is None else colour.rgba[:3]
    )


_KINDS = ("box", "cylinder", "sphere", "mesh")


def mesh_surfaces(shapes: Iterable[DescribedShape]) -> dict[str, tuple[Piece, ...]]:
    """Returns the surfaces of the meshes by the names of their files, without those that cannot be read."""
    files = [shape.mesh for shape in shapes if shape.kind == "mesh"]
    if not files:
        return {}
    from robots.meshes.surfaces import mesh_pieces  # it loads trimesh, which most descriptions do not need

    return mesh_pieces(files)

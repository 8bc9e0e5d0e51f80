"""The visual shapes of a robot: triangles per moving body, from the URDF's visuals or from generated
capsules."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import trimesh
from lxml import etree
from lxml.etree import _Element as Element

from robots.meshes.surfaces import Colour, Piece, joined, limited, mesh_pieces, split_creases
from robots.robot import Robot
from robots.shapes.capsules import body_capsules
from robots.urdf.read import Refusal, placement

MAX_TOTAL = 400_000  # largest number of faces of a robot
_FARTHEST = 1e3  # largest coordinate of a point in the axes of its joint, m
_COLOURS = 8  # largest number of shapes of a link: each is a separate object on the page
_DEFAULT = (205, 209, 216)  # colour of a mesh without a colour


@dataclass(frozen=True, eq=False)
class Shape:
    """One coloured piece of a robot's surface.

    joint: the Pinocchio joint to which the piece is fixed, 0 = the world; vertices (V, 3) float32, m, in the
    joint's frame; faces (F, 3) int32, counter-clockwise seen from outside; colour 0–255; name: unique. Faces
    share vertices only where the surface is smooth: averaged vertex normals can be used for shading.
    """

    joint: int
    vertices: np.ndarray
    faces: np.ndarray
    colour: Colour
    name: str


@np.errstate(all="ignore")
def link_shapes(robot: Robot) -> list[Shape]:
    """Returns the shapes of all links. Visuals that cannot be drawn and visuals beyond MAX_TOTAL faces are
    left out. A body without any remaining shape is drawn as capsules along its kinematics. No content of the
    description or of a mesh file raises an error.
    """
    root = etree.fromstring(robot.urdf_text.encode())
    palette = _materials(root)
    meshes = mesh_pieces(mesh.get("filename", "") for mesh in root.iterfind("link/visual/geometry/mesh"))
    shapes: list[Shape] = []
    left = MAX_TOTAL
    for link in root.findall("link"):
        frame = robot.model.frames[robot.frame_id(link.get("name", ""))]
        pieces: dict[Colour, list[tuple[np.ndarray, np.ndarray]]] = {}
        for visual in link.findall("visual"):
            for colour, vertices, faces in _visual(visual, palette, meshes):
                placed = vertices @ frame.placement.rotation.T + frame.placement.translation
                near = np.abs(placed).max(initial=0.0) < _FARTHEST  # this comparison is false for NaN
                if not near or not 0 < len(faces) <= left:
                    continue
                left -= len(faces)
                shown = colour if colour in pieces or len(pieces) < _COLOURS else next(iter(pieces))
                pieces.setdefault(shown, []).append((placed, faces))
        for k, (colour, parts) in enumerate(pieces.items()):
            vertices, faces = joined(parts)
            name = f"{link.get('name')}/{k}"
            shapes.append(
                Shape(frame.parentJoint, vertices.astype(np.float32), faces.astype(np.int32), colour, name)
            )
    drawn = {shape.joint for shape in shapes}
    for piece in body_capsules(robot.model, robot.frame_id(robot.tip), drawn):
        vertices, faces = piece.vertices.astype(np.float32), piece.faces.astype(np.int32)
        shapes.append(Shape(piece.joint, vertices, faces, piece.colour, piece.name))
    return shapes


def _visual(
    visual: Element, palette: dict[str, Colour], meshes: Mapping[str, tuple[Piece, ...]]
) -> list[tuple[Colour, np.ndarray, np.ndarray]]:
    """Yields (colour, vertices in the link's frame, faces) of one <visual>; nothing if one of its numbers is
    invalid."""
    geometry = visual.find("geometry")
    if geometry is None or len(geometry) == 0:
        return []
    given = _material_colour(visual.find("material"), palette)
    try:
        at = placement(visual)
        return [
            (given or own or _DEFAULT, vertices @ at.rotation.T + at.translation, faces)
            for own, vertices, faces in _geometry(geometry[0], meshes)
        ]
    except (ValueError, Refusal):
        return []


def _geometry(shape: Element, meshes: Mapping[str, tuple[Piece, ...]]) -> Iterator[Piece]:
    """Yields the pieces of one geometry element. Raises ValueError for a size that is not a number."""
    if shape.tag == "mesh":
        scale = np.broadcast_to(_numbers(shape, "scale", "1 1 1"), 3)
        for colour, vertices, faces in meshes.get(shape.get("filename", ""), ()):
            yield colour, vertices * scale, faces[:, ::-1] if np.prod(scale) < 0.0 else faces
        return
    if shape.tag == "box":
        size = np.broadcast_to(_numbers(shape, "size"), 3)
    elif shape.tag == "cylinder":
        (radius,), (height,) = _numbers(shape, "radius"), _numbers(shape, "length")
        size = np.array([radius, radius, height])
    elif shape.tag == "sphere":
        (radius,) = _numbers(shape, "radius")
        size = np.full(3, radius)
    else:
        return
    vertices, faces = _unit(shape.tag)
    yield None, vertices * np.abs(size), faces


def _numbers(element: Element, name: str, default: str = "") -> np.ndarray:
    return np.array([float(word) for word in element.get(name, default).split()])


@lru_cache(maxsize=4)
def _unit(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns a box with edges of 1, a cylinder of radius 1 and length 1, or a sphere of radius 1."""
    if kind == "sphere":
        solid = trimesh.creation.icosphere(subdivisions=3)
        return np.asarray(solid.vertices), np.asarray(solid.faces)
    solid = trimesh.creation.box() if kind == "box" else trimesh.creation.cylinder(1.0, 1.0, sections=32)
    return split_creases(np.asarray(solid.vertices), np.asarray(solid.faces))


def _materials(root: Element) -> dict[str, Colour]:
    found: dict[str, Colour] = {}
    for material in root.iter("material"):
        colour = _material_colour(material, {})
        if colour is not None:
            found.setdefault(material.get("name", ""), colour)
    return found


def _material_colour(material: Element | None, palette: dict[str, Colour]) -> Colour | None:
    if material is None:
        return None
    colour = material.find("color")
    if colour is None:
        return palette.get(material.get("name", ""))
    try:
        return limited(255.0 * np.array([float(word) for word in colour.get("rgba", "").split()[:3]]))
    except ValueError:
        return None

"""What a robot looks like: triangles per moving body, from the URDF's visuals or generated capsules."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import trimesh
from lxml import etree
from lxml.etree import _Element as Element

from robots.capsules import body_capsules
from robots.robot import Robot
from robots.simplify import simplify

MAX_FACES = 12_000  # per link: what a browser on a laptop still turns smoothly with several robots
_DEFAULT = (205, 209, 216)  # a mesh that names no colour
_BRIGHTEST = 238  # pure white loses all shading under the page's lights
_Colour = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Shape:
    """One coloured piece of a robot's surface.

    joint: the Pinocchio joint whose frame it moves with, 0 = the world; vertices (V, 3) float32, m, in that
    joint's frame; faces (F, 3) int32, counter-clockwise seen from outside; colour 0–255; name: unique.
    Vertices are shared only where the surface is smooth, so averaged vertex normals shade it well.
    """

    joint: int
    vertices: np.ndarray
    faces: np.ndarray
    colour: _Colour
    name: str


def link_shapes(robot: Robot) -> list[Shape]:
    """The shapes of all links. A visual that cannot be loaded is left out; a body that then has no shape
    at all is drawn as capsules along its kinematics. Never raises for what a mesh file contains.
    """
    root = etree.fromstring(robot.urdf_text.encode())
    palette = _materials(root)
    shapes: list[Shape] = []
    for link in root.findall("link"):
        frame = robot.model.frames[robot.frame_id(link.get("name", ""))]
        pieces: dict[_Colour, list[tuple[np.ndarray, np.ndarray]]] = {}
        for visual in link.findall("visual"):
            for colour, vertices, faces in _visual(visual, palette):
                placed = frame.placement.rotation @ vertices.T + frame.placement.translation[:, None]
                pieces.setdefault(colour, []).append((placed.T, faces))
        for k, (colour, parts) in enumerate(pieces.items()):
            vertices, faces = _joined(parts)
            name = f"{link.get('name')}/{k}"
            shapes.append(
                Shape(frame.parentJoint, vertices.astype(np.float32), faces.astype(np.int32), colour, name)
            )
    drawn = {shape.joint for shape in shapes}
    for piece in body_capsules(robot.model, robot.frame_id(robot.tip), drawn):
        vertices, faces = piece.vertices.astype(np.float32), piece.faces.astype(np.int32)
        shapes.append(Shape(piece.joint, vertices, faces, piece.colour, piece.name))
    return shapes


_Piece = tuple[_Colour, np.ndarray, np.ndarray]


def _visual(visual: Element, palette: dict[str, _Colour]) -> Iterator[_Piece]:
    """(colour, vertices in the link's frame, faces) of one <visual>."""
    try:
        geometry = visual.find("geometry")
        if geometry is None or len(geometry) == 0:
            return
        given = _material_colour(visual.find("material"), palette)
        placement = _origin(visual.find("origin"))
        for own, vertices, faces in _geometry(geometry[0]):
            placed = placement.rotation @ vertices.T + placement.translation[:, None]
            yield given or own or _DEFAULT, placed.T, faces
    except Exception:
        # Mesh readers raise whatever they like on a bad file; the body falls back to capsules.
        return


def _geometry(shape: Element) -> Iterator[tuple[_Colour | None, np.ndarray, np.ndarray]]:
    if shape.tag == "mesh":
        scale = np.array([float(word) for word in shape.get("scale", "1 1 1").split()])
        for colour, vertices, faces in load_mesh(Path(shape.get("filename", ""))):
            mirrored = np.prod(np.broadcast_to(scale, 3)) < 0.0
            yield colour, vertices * scale, faces[:, ::-1] if mirrored else faces
        return
    if shape.tag == "box":
        solid = trimesh.creation.box([float(word) for word in shape.get("size", "").split()])
    elif shape.tag == "cylinder":
        radius, height = float(shape.get("radius", "")), float(shape.get("length", ""))
        solid = trimesh.creation.cylinder(radius, height, sections=32)
    elif shape.tag == "sphere":
        solid = trimesh.creation.icosphere(subdivisions=3, radius=float(shape.get("radius", "")))
    else:
        return
    smooth = shape.tag == "sphere"
    vertices, faces = np.asarray(solid.vertices), np.asarray(solid.faces)
    yield (None, vertices, faces) if smooth else (None, *_split_creases(vertices, faces))


@lru_cache(maxsize=256)
def load_mesh(path: Path) -> tuple[tuple[_Colour | None, np.ndarray, np.ndarray], ...]:
    """(colour or None, vertices (V, 3) m, faces (F, 3)) per material of a mesh file, simplified."""
    scene = trimesh.load_scene(str(path))
    pieces: dict[_Colour | None, list[tuple[np.ndarray, np.ndarray]]] = {}
    for solid in scene.dump():
        if isinstance(solid, trimesh.Trimesh) and len(solid.faces):
            vertices, faces = np.asarray(solid.vertices), np.asarray(solid.faces)
            if path.suffix.lower() == ".stl":
                vertices, faces = _split_creases(vertices, faces)
            pieces.setdefault(_mesh_colour(solid, path), []).append((vertices, faces))
    total = sum(len(faces) for parts in pieces.values() for _, faces in parts)
    share = min(1.0, MAX_FACES / max(total, 1))
    joined = {colour: _joined(parts) for colour, parts in pieces.items()}
    return tuple((c, *simplify(v, f, max(200, int(share * len(f))))) for c, (v, f) in joined.items())


def _mesh_colour(solid: trimesh.Trimesh, path: Path) -> _Colour | None:
    if path.suffix.lower() == ".stl":
        return None
    material = getattr(solid.visual, "material", None)
    colour = getattr(material if material is not None else solid.visual, "main_color", None)
    return None if colour is None else _limited(np.asarray(colour, dtype=float)[:3])


def _joined(parts: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return vertices, np.concatenate(
        [faces + start for (_, faces), start in zip(parts, offsets, strict=False)]
    )


def _split_creases(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gives each side of a sharp edge its own vertices, by grouping a vertex' faces by direction."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-30
    directions = np.round(1.2 * normals).astype(np.int64)
    keys = np.column_stack([faces.reshape(-1), np.repeat(directions, 3, axis=0)])
    unique, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return vertices[unique[:, 0]], inverse.reshape(-1, 3) if len(first) else faces


def _materials(root: Element) -> dict[str, _Colour]:
    found: dict[str, _Colour] = {}
    for material in root.iter("material"):
        colour = _material_colour(material, {})
        if colour is not None:
            found.setdefault(material.get("name", ""), colour)
    return found


def _material_colour(material: Element | None, palette: dict[str, _Colour]) -> _Colour | None:
    if material is None:
        return None
    colour = material.find("color")
    if colour is None:
        return palette.get(material.get("name", ""))
    try:
        return _limited(255.0 * np.array([float(word) for word in colour.get("rgba", "").split()[:3]]))
    except ValueError:
        return None


def _limited(colour: np.ndarray) -> _Colour | None:
    if colour.shape != (3,) or not np.all(np.isfinite(colour)):
        return None
    red, green, blue = (int(c) for c in np.clip(np.round(colour), 0, _BRIGHTEST))
    return red, green, blue


def _origin(origin: Element | None) -> pin.SE3:
    if origin is None:
        return pin.SE3.Identity()
    xyz, rpy = (
        np.array([float(word) for word in origin.get(key, "0 0 0").split()]) for key in ("xyz", "rpy")
    )
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)

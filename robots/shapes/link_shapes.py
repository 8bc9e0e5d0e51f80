"""The visual shapes of a robot: triangles per moving body, from the URDF's visuals or from generated
capsules."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import chain

import numpy as np
import trimesh

from robots.geometry import Shape
from robots.meshes.surfaces import Colour, Piece, joined, limited, split_creases
from robots.robot import Robot
from robots.shapes.capsules import body_capsules
from robots.shapes.read import DescribedShape, described_shapes, mesh_surfaces

MAX_TOTAL = 400_000  # largest number of faces of a robot
_FARTHEST = 1e3  # largest coordinate of a point in the axes of its joint, m
_COLOURS = 8  # largest number of shapes of a link: each is a separate object on the page
_DEFAULT = (205, 209, 216)  # colour of a mesh without a colour


@np.errstate(all="ignore")
def link_shapes(robot: Robot) -> list[Shape]:
    """Returns the shapes of all links. Visuals that cannot be drawn and visuals beyond MAX_TOTAL faces are
    left out. A body without any remaining shape is drawn as capsules along its kinematics. No content of the
    description or of a mesh file raises an error.
    """
    if robot.surfaces:
        return list(robot.surfaces)
    visuals = described_shapes(robot, "visuals")
    meshes = mesh_surfaces(chain(*visuals.values()))
    shapes: list[Shape] = []
    left = MAX_TOTAL
    for link, shown in visuals.items():
        pieces: dict[Colour, list[tuple[np.ndarray, np.ndarray]]] = {}
        for visual in shown:
            for colour, vertices, faces in _surface(visual, meshes):
                placed = vertices @ visual.at.rotation.T + visual.at.translation
                near = np.abs(placed).max(initial=0.0) < _FARTHEST  # this comparison is false for NaN
                if not near or not 0 < len(faces) <= left:
                    continue
                left -= len(faces)
                known = colour if colour in pieces or len(pieces) < _COLOURS else next(iter(pieces))
                pieces.setdefault(known, []).append((placed, faces))
        for k, (colour, parts) in enumerate(pieces.items()):
            vertices, faces = joined(parts)
            vertices, faces = vertices.astype(np.float32), faces.astype(np.int32)
            shapes.append(Shape(shown[0].joint, vertices, faces, colour, f"{link}/{k}"))
    drawn = {shape.joint for shape in shapes}
    for piece in body_capsules(robot.model, robot.frame_id(robot.tip), drawn):
        vertices, faces = piece.vertices.astype(np.float32), piece.faces.astype(np.int32)
        shapes.append(Shape(piece.joint, vertices, faces, piece.colour, piece.name))
    return shapes


def _surface(
    visual: DescribedShape, meshes: Mapping[str, tuple[Piece, ...]]
) -> Iterator[tuple[Colour, np.ndarray, np.ndarray]]:
    """Yields (colour, vertices, faces) of a visual shape in its own axes."""
    given = None if visual.colour is None else limited(255.0 * visual.colour)
    if visual.kind == "mesh":
        mirrored = np.prod(visual.size) < 0.0
        for own, vertices, faces in meshes.get(visual.mesh, ()):
            yield given or own or _DEFAULT, vertices * visual.size, faces[:, ::-1] if mirrored else faces
        return
    edges = visual.size[[0, 0, 1]] if visual.kind == "cylinder" else np.broadcast_to(visual.size, 3)
    vertices, faces = _unit(visual.kind)
    yield given or _DEFAULT, vertices * np.abs(edges), faces


@lru_cache(maxsize=4)
def _unit(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns a box with edges of 1, a cylinder of radius 1 and length 1, or a sphere of radius 1."""
    if kind == "sphere":
        solid = trimesh.creation.icosphere(subdivisions=3)
        return np.asarray(solid.vertices), np.asarray(solid.faces)
    solid = trimesh.creation.box() if kind == "box" else trimesh.creation.cylinder(1.0, 1.0, sections=32)
    return split_creases(np.asarray(solid.vertices), np.asarray(solid.faces))

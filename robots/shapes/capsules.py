"""Generates visual shapes. Bodies without meshes get capsules from joint to joint, and a drum at each
revolute joint. Covers get the shapes of their capsules."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import pinocchio as pin
import trimesh

from robots.geometry import Cover
from robots.joints import joint_axis
from robots.shapes.limbs import BODY, DRUM, TIP, Colour, Limb, joint_radius, limbs

COVER: Colour = (86, 140, 200)


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Triangles in the frame of a Pinocchio joint (0 = world); vertices in m."""

    joint: int
    vertices: np.ndarray
    faces: np.ndarray
    colour: Colour
    name: str


def body_capsules(model: pin.Model, tip: int, drawn: set[int]) -> Iterator[MeshPart]:
    """Generates the shapes of every body of the model that is not in `drawn`. tip: frame index of the
    end-effector."""
    every = list(limbs(model, tip, drawn))
    for joint in range(model.njoints):
        if joint in drawn:
            continue
        for limb in every:
            if limb.joint == joint:
                yield from _limb(limb) if joint > 0 or drawn else _pedestal(limb)
        if joint > 0:
            yield _drum(model, joint, 1.25 * joint_radius(model, tip, joint))


def _limb(limb: Limb) -> Iterator[MeshPart]:
    joint, k, end, radius, colour = limb
    vertices, faces = _capsule(float(np.linalg.norm(end)), radius, 24)
    if colour == TIP:
        yield MeshPart(joint, _along(vertices, end), faces, BODY, f"body{joint}/limb{k}")
        ball = trimesh.creation.icosphere(subdivisions=3, radius=1.08 * radius)
        yield MeshPart(
            joint, np.asarray(ball.vertices) + end, np.asarray(ball.faces), TIP, f"body{joint}/tip"
        )
    else:
        yield MeshPart(joint, _along(vertices, end), faces, colour, f"body{joint}/limb{k}")


def _capsule(length: float, radius: float, sections: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns (vertices, faces) of a capsule along z, from 0 to a length."""
    solid = trimesh.creation.capsule(height=length, radius=radius, count=[sections, sections])
    vertices = np.asarray(solid.vertices)
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    return vertices - middle + np.array([0.0, 0.0, 0.5 * length]), np.asarray(solid.faces)


def cover_parts(cover: Cover) -> Iterator[MeshPart]:
    """Generates the shapes of a cover, one for each body that has capsules."""
    for joint, capsules in groupby(cover.capsules, lambda capsule: capsule.joint):
        vertices: list[np.ndarray] = []
        faces: list[np.ndarray] = []
        for capsule in capsules:
            axis = np.subtract(capsule.end, capsule.start)
            length = float(np.linalg.norm(axis))
            points, triangles = _capsule(length, capsule.radius, 16)
            faces.append(triangles + sum(map(len, vertices)))
            vertices.append((_along(points, axis) if length > 0.0 else points) + capsule.start)
        yield MeshPart(joint, np.concatenate(vertices), np.concatenate(faces), COVER, f"cover/{joint}")


def _pedestal(limb: Limb) -> Iterator[MeshPart]:
    height = float(np.linalg.norm(limb.end))
    solid = trimesh.creation.cylinder(limb.radius, height, sections=40)
    vertices, faces = _hard_edged(solid)
    shifted = vertices + np.array([0.0, 0.0, 0.5 * height])
    yield MeshPart(0, _along(shifted, limb.end), faces, DRUM, "base/pedestal")


def _drum(model: pin.Model, joint: int, radius: float) -> MeshPart:
    prismatic, axis = joint_axis(model, joint)
    if prismatic:
        vertices, faces = _hard_edged(trimesh.creation.box([1.6 * radius, 1.6 * radius, 2.4 * radius]))
    else:
        vertices, faces = _hard_edged(trimesh.creation.cylinder(radius, 2.2 * radius, sections=40))
    return MeshPart(joint, _along(vertices, axis), faces, DRUM, f"body{joint}/drum")


def _along(vertices: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Returns vertices that are modelled along z, rotated so that z points along `direction`."""
    unit = direction / np.linalg.norm(direction)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), unit).toRotationMatrix()
    return vertices @ turn.T


def _hard_edged(solid: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Returns the mesh with separate vertices for the caps and the curved side, so that the edge between them
    looks sharp."""
    faces = np.asarray(solid.faces)
    directions = np.round(1.2 * np.asarray(solid.face_normals)).astype(int)
    mantle = np.where(np.abs(directions[:, 2]) > 0, directions[:, 2], 0)
    box = len(faces) == 12
    side = directions if box else mantle[:, None]
    keys = np.column_stack([faces.reshape(-1), np.repeat(side, 3, axis=0)])
    unique, inverse = np.unique(keys, axis=0, return_inverse=True)
    return np.asarray(solid.vertices)[unique[:, 0]], inverse.reshape(-1, 3)

"""Generates visual shapes for bodies without meshes: capsules from joint to joint, and a drum at each
revolute joint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import trimesh

from robots.truth import joint_axis

Colour = tuple[int, int, int]

_BODY: Colour = (222, 226, 231)
_DRUM: Colour = (74, 82, 94)
_TIP: Colour = (236, 122, 44)
_SHORTEST = 0.004  # m: two joints that are closer than this share one drum
_SLENDER = 0.05  # capsule radius divided by the length of the whole chain


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
    thickness = _SLENDER * max(_chain_length(model, tip), 0.05)
    for joint in range(model.njoints):
        if joint in drawn:
            continue
        radius = _radius(model, joint, thickness)
        children = [k for k in range(1, model.njoints) if model.parents[k] == joint]
        ends: list[tuple[np.ndarray, Colour]] = [
            (model.jointPlacements[k].translation, _BODY) for k in children
        ]
        if model.frames[tip].parentJoint == joint:
            ends.append((model.frames[tip].placement.translation, _TIP))
        if joint > 0 and not any(np.linalg.norm(end) >= _SHORTEST for end, _ in ends):
            ends.append((_farthest(model, joint), _BODY))
        for k, (end, colour) in enumerate(ends):
            if joint > 0 or drawn:
                yield from _limb(joint, np.asarray(end), radius, colour, k)
        if joint == 0 and not drawn and ends:
            yield from _pedestal(np.asarray(ends[0][0]), 1.5 * thickness)
        if joint > 0:
            yield _drum(model, joint, 1.25 * radius)


def _farthest(model: pin.Model, joint: int) -> np.ndarray:
    """Returns the position of the farthest frame on a body without children, in its joint's frame, m."""
    own = [frame.placement.translation for frame in model.frames if frame.parentJoint == joint]
    return max(own, key=lambda at: float(np.linalg.norm(at)))


def _limb(joint: int, end: np.ndarray, radius: float, colour: Colour, k: int) -> Iterator[MeshPart]:
    length = float(np.linalg.norm(end))
    if length < _SHORTEST:
        return
    radius = min(radius, 0.45 * length)
    solid = trimesh.creation.capsule(height=length, radius=radius, count=[24, 24])
    vertices = np.asarray(solid.vertices)
    vertices = (
        vertices - 0.5 * (vertices.min(axis=0) + vertices.max(axis=0)) + np.array([0.0, 0.0, 0.5 * length])
    )
    if colour == _TIP:
        yield MeshPart(joint, _along(vertices, end), np.asarray(solid.faces), _BODY, f"body{joint}/limb{k}")
        ball = trimesh.creation.icosphere(subdivisions=3, radius=1.08 * radius)
        yield MeshPart(
            joint, np.asarray(ball.vertices) + end, np.asarray(ball.faces), _TIP, f"body{joint}/tip"
        )
    else:
        yield MeshPart(joint, _along(vertices, end), np.asarray(solid.faces), colour, f"body{joint}/limb{k}")


def _pedestal(top: np.ndarray, radius: float) -> Iterator[MeshPart]:
    """Generates a column from the floor to the first joint, or a flat foot if that joint is on the floor."""
    height = max(float(np.linalg.norm(top)), 0.5 * radius)
    end = top if float(np.linalg.norm(top)) > 0.5 * radius else np.array([0.0, 0.0, -height])
    solid = trimesh.creation.cylinder(radius, height, sections=40)
    vertices, faces = _hard_edged(solid)
    shifted = vertices + np.array([0.0, 0.0, 0.5 * height])
    yield MeshPart(0, _along(shifted, end), faces, _DRUM, "base/pedestal")


def _drum(model: pin.Model, joint: int, radius: float) -> MeshPart:
    prismatic, axis = joint_axis(model, joint)
    if prismatic:
        vertices, faces = _hard_edged(trimesh.creation.box([1.6 * radius, 1.6 * radius, 2.4 * radius]))
    else:
        vertices, faces = _hard_edged(trimesh.creation.cylinder(radius, 2.2 * radius, sections=40))
    return MeshPart(joint, _along(vertices, axis), faces, _DRUM, f"body{joint}/drum")


def _along(vertices: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Returns vertices that are modelled along z, rotated so that z points along `direction`."""
    unit = direction / np.linalg.norm(direction)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), unit).toRotationMatrix()
    return vertices @ turn.T


def _hard_edged(solid: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Returns the mesh with separate vertices for caps and mantle, so that shading keeps the edge between
    them sharp."""
    faces = np.asarray(solid.faces)
    directions = np.round(1.2 * np.asarray(solid.face_normals)).astype(int)
    mantle = np.where(np.abs(directions[:, 2]) > 0, directions[:, 2], 0)
    box = len(faces) == 12
    side = directions if box else mantle[:, None]
    keys = np.column_stack([faces.reshape(-1), np.repeat(side, 3, axis=0)])
    unique, inverse = np.unique(keys, axis=0, return_inverse=True)
    return np.asarray(solid.vertices)[unique[:, 0]], inverse.reshape(-1, 3)


def _radius(model: pin.Model, joint: int, thickness: float) -> float:
    """Returns the radius of a capsule, m: it decreases towards the tip, which makes the chain easier to
    see."""
    depth = len(model.supports[joint]) - 1
    deepest = max(len(support) for support in model.supports) - 1
    return thickness * (1.0 - 0.4 * depth / max(deepest, 1))


def _chain_length(model: pin.Model, tip: int) -> float:
    frame = model.frames[tip]
    steps = [model.jointPlacements[k].translation for k in model.supports[frame.parentJoint] if k > 0]
    return sum(float(np.linalg.norm(step)) for step in (*steps, frame.placement.translation))

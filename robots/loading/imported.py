"""Adds collision geometry and cover to an imported robot, and notes about them to its report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import PurePath

import numpy as np

from robots.covering.covers import made_cover
from robots.errors import listed
from robots.floor import no_floor
from robots.geometry.collision_model import CollisionModel
from robots.geometry.cover import Cover
from robots.mechanics.exclusions import collision_model
from robots.report import Finding
from robots.robot import Robot
from robots.shapes.collision_shapes import collision_solids
from robots.shapes.limbs import chain_length
from robots.shapes.read import described_shapes, mesh_surfaces

_FAR_LARGER = 5.0  # size of a link's mesh, divided by the length of the arm


def with_collision(robot: Robot, meshes: bool = True) -> Robot:
    """Returns the robot with its collision geometry.

    meshes: whether mesh files are read; otherwise capsules replace bodies with meshes. If MuJoCo cannot use
    the shapes, all shapes are left out. The report notes this. It also notes why a robot has no floor.
    """
    try:
        found = collision_model(robot, collision_solids(robot, meshes))
        text = str(found)
    except (ValueError, RuntimeError):
        found, text = CollisionModel(), "MuJoCo cannot use the robot's shapes: the robot touches nothing"
    if not meshes:
        text += "; reading its meshes takes too long or fails"
    with_solids = replace(_noted(robot, "contacts", text), collision=found)
    return _noted(with_solids, "floor", missing) if (missing := no_floor(with_solids)) else with_solids


def with_cover(robot: Robot, meshes: bool = True) -> Robot:
    """Returns a robot with the capsules that distances use. The robot must have its collision geometry.

    meshes: whether mesh files are read. If capsules cannot contain the robot, it gets none, and the report
    notes this.
    """
    try:
        found = made_cover(robot, meshes)
        text = str(found)
    except (ValueError, RuntimeError, ArithmeticError):
        found, text = Cover(), "no capsules contain the robot's shapes: no distance is kept"
    return replace(_noted(robot, "distances", text), cover=found)


def with_geometry(robot: Robot, meshes: bool = True) -> Robot:
    """Returns the robot with its collision geometry and its capsules, and notes about its meshes."""
    for finding in _about_meshes(robot) if meshes else ():
        robot = _noted(robot, finding.where, finding.text)
    return with_cover(with_collision(robot, meshes), meshes)


def _about_meshes(robot: Robot) -> Iterator[Finding]:
    """Yields a note for the meshes that could not be read, and for each link whose meshes are far larger than
    the arm."""
    shapes = [
        shape
        for what in ("visuals", "collisions")
        for found in described_shapes(robot, what).values()
        for shape in found
        if shape.kind == "mesh"
    ]
    surfaces = mesh_surfaces(shapes)
    missing = dict.fromkeys(PurePath(shape.mesh).name for shape in shapes if shape.mesh not in surfaces)
    if missing:
        yield Finding("note", "meshes", f"{len(missing)} mesh file(s) could not be read ({listed(missing)})")
    sizes: dict[str, float] = {}
    for shape in shapes:
        for _, vertices, _ in surfaces.get(shape.mesh, ()):
            extent = float((np.ptp(vertices, axis=0) * np.abs(shape.size)).max())
            sizes[shape.link] = max(extent, sizes.get(shape.link, 0.0))
    reach = chain_length(robot.model, robot.frame_id(robot.tip))
    for link, size in sizes.items():
        if size > _FAR_LARGER * reach:
            text = (
                f"its meshes are {size:.3g} m large, the whole arm is {reach:.2g} m long: STL and OBJ files"
            )
            text += ' have no unit; scale="0.001 0.001 0.001" in <mesh> turns millimetres into metres'
            yield Finding("note", f"link '{link}'", text)


def _noted(robot: Robot, where: str, text: str) -> Robot:
    findings = (*robot.report.findings, Finding("note", where, text))
    return replace(robot, report=replace(robot.report, findings=findings))

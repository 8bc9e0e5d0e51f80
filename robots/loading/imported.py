"""Adds collision geometry and cover to an imported robot, and notes about them to its report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from robots.collision import base_joint
from robots.covering.covers import made_cover, own_pairs
from robots.errors import listed
from robots.floor import no_floor, stands
from robots.geometry import CollisionModel, Cover
from robots.joints import chain_length
from robots.loading.home import find_home
from robots.mechanics.exclusions import collision_model, lowest
from robots.report import Finding
from robots.robot import Robot
from robots.shapes.collision_shapes import collision_solids
from robots.shapes.read import DescribedShape, described_shapes, mesh_surfaces

if TYPE_CHECKING:
    from robots.meshes.surfaces import Piece

CLEAR = 0.04
"""The smallest height of a moving shape above the floor at an estimated home, m: twice the distance that is
kept from the floor."""
WRONG_SIZE = 0.02, 5.0
"""Size of the meshes of a link, divided by the length of the arm: the largest link of a robot is not smaller
than the first number, and no link is larger than the second."""


def with_collision(robot: Robot, meshes: bool = True) -> Robot:
    """Returns the robot with its collision geometry, and with a home at which its hand is not at the floor.

    meshes: whether mesh files are read; otherwise capsules replace bodies with meshes. If MuJoCo cannot use
    the shapes, all shapes are left out. The report notes this. It also notes why a robot has no floor.
    """
    try:
        robot = _raised(replace(robot, collision=collision_model(robot, collision_solids(robot, meshes))))
        text = str(robot.collision)
    except (ValueError, RuntimeError):
        robot = replace(robot, collision=CollisionModel())
        text = "MuJoCo cannot use the robot's shapes: the robot touches nothing"
    if not meshes:
        text += "; reading its meshes takes too long or fails"
    robot = _noted(robot, "contacts", text)
    return _noted(robot, "floor", missing) if (missing := no_floor(robot)) else robot


def _raised(robot: Robot) -> Robot:
    """Returns the robot with a higher home if its shapes are nearer than CLEAR to the floor at home, and if
    its home was estimated: a hand may reach lower than the frame by which it is dragged."""
    base, rest = lowest(robot)
    if base is None or not stands(base) or rest is None or rest >= CLEAR:
        return robot
    model, frame, limits = robot.model, robot.frame_id(robot.tip), (robot.q_lower, robot.q_upper)
    if not np.array_equal(robot.home, find_home(model, frame, *limits)):
        return robot
    data = model.createData()
    pin.forwardKinematics(model, data, robot.home)
    height = float(pin.updateFramePlacement(model, data, frame).translation[2])
    home = find_home(model, frame, *limits, least_height=height + CLEAR - rest)
    higher = replace(robot, home=home)
    higher = replace(higher, collision=collision_model(higher, robot.collision.solids))
    return higher if (lowest(higher)[1] or 0.0) > rest else robot


def with_cover(robot: Robot, meshes: bool = True) -> Robot:
    """Returns a robot with the capsules that distances use. The robot must have its collision geometry.

    Two moving bodies with a single body between them whose capsules are too near to keep a distance do not
    touch in the plant either: the controller would press one against the other. The shapes of such links, as
    link 5 and link 7 of many arms, are thicker than the real ones.

    meshes: whether mesh files are read. If capsules cannot contain the robot, it gets none, and the report
    notes this.
    """
    try:
        found = made_cover(robot, meshes)
        text = str(found)
    except (ValueError, RuntimeError, ArithmeticError):
        found, text = Cover(), "no capsules contain the robot's shapes: no distance is kept"
    robot = replace(_noted(robot, "distances", text), cover=found)
    parents, base = robot.model.parents, base_joint(robot)
    nested = tuple(
        pair for pair in own_pairs(robot, found) if parents[parents[pair.second]] == pair.first > base
    )
    if not nested:
        return robot
    pairs = ", ".join(" – ".join(pair.names) for pair in nested)
    text = f"{pairs}: these links pass through each other, as no distance between them can be kept"
    collision = replace(robot.collision, excluded=(*robot.collision.excluded, *nested))
    return replace(_noted(robot, "contacts", text), collision=collision)


def with_geometry(robot: Robot, meshes: bool = True) -> Robot:
    """Returns the robot with its collision geometry and its capsules, and notes about its meshes."""
    if meshes:
        drawn, findings = _about_meshes(robot)
        report = replace(robot.report, drawn=drawn, findings=(*robot.report.findings, *findings))
        robot = replace(robot, report=report)
    return with_cover(with_collision(robot, meshes), meshes)


def _about_meshes(robot: Robot) -> tuple[float | None, list[Finding]]:
    """Returns the report's `drawn`, a note for the meshes that could not be read, and one for each link whose
    meshes are far larger than the arm, or for all meshes if they are far smaller."""
    visuals, collisions = (
        [shape for found in described_shapes(robot, what).values() for shape in found if shape.kind == "mesh"]
        for what in ("visuals", "collisions")
    )
    shapes, findings = [*visuals, *collisions], []
    surfaces = mesh_surfaces(shapes)
    missing = dict.fromkeys(PurePath(shape.mesh).name for shape in shapes if shape.mesh not in surfaces)
    if missing:
        text = f"{len(missing)} mesh file(s) could not be read ({listed(missing)})"
        findings.append(Finding("note", "meshes", text))
    reach = chain_length(robot.model, robot.frame_id(robot.tip), from_world=True)
    for link, size in _sizes(shapes, surfaces).items():
        if size > WRONG_SIZE[1] * reach:
            text = (
                f"its meshes are {size:.3g} m large, the whole arm is {reach:.2g} m long: STL and OBJ files"
            )
            text += ' have no unit; scale="0.001 0.001 0.001" in <mesh> turns millimetres into metres'
            findings.append(Finding("note", f"link '{link}'", text))
    size = max(_sizes(visuals, surfaces).values(), default=0.0)
    if 0.0 < size < WRONG_SIZE[0] * reach:
        text = (
            f"the largest link is drawn {1e3 * size:.2g} mm large, the whole arm is {reach:.2g} m long: check"
        )
        findings.append(Finding("note", "meshes", f"{text} the scale in <mesh>"))
    return size / reach if size > 0.0 and reach > 0.0 else None, findings


def _sizes(shapes: list[DescribedShape], surfaces: Mapping[str, tuple[Piece, ...]]) -> dict[str, float]:
    """Returns the size of the largest mesh of each link, the longest edge of its bounding box, m."""
    sizes: dict[str, float] = {}
    for shape in shapes:
        for _, vertices, _ in surfaces.get(shape.mesh, ()):
            extent = float((np.ptp(vertices, axis=0) * np.abs(shape.size)).max())
            sizes[shape.link] = max(extent, sizes.get(shape.link, 0.0))
    return sizes


def _noted(robot: Robot, where: str, text: str) -> Robot:
    findings = (*robot.report.findings, Finding("note", where, text))
    return replace(robot, report=replace(robot.report, findings=findings))

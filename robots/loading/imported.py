"""Adds collision geometry and cover to an imported robot, and notes about them to its report."""

from __future__ import annotations

from dataclasses import replace

from robots.covering.covers import made_cover
from robots.floor import no_floor
from robots.geometry.collision_model import CollisionModel
from robots.geometry.cover import Cover
from robots.mechanics.exclusions import collision_model
from robots.report import Finding
from robots.robot import Robot
from robots.shapes.collision_shapes import collision_solids


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
    """Returns the robot with its collision geometry and its capsules."""
    return with_cover(with_collision(robot, meshes), meshes)


def _noted(robot: Robot, where: str, text: str) -> Robot:
    findings = (*robot.report.findings, Finding("note", where, text))
    return replace(robot, report=replace(robot.report, findings=findings))

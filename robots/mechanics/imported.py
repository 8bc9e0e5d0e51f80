"""Gives an imported robot its collision geometry, and a line about it in the import report."""

from __future__ import annotations

from dataclasses import replace

from robots.collision_model import CollisionModel
from robots.collision_shapes import collision_solids
from robots.mechanics.exclusions import collision_model
from robots.report import Finding
from robots.robot import Robot


def with_collision(robot: Robot, meshes: bool = True) -> Robot:
    """Returns the robot with its collision geometry.

    meshes: whether mesh files are read; without them their bodies become capsules. Shapes that MuJoCo
    cannot use are all left out, and the report says so.
    """
    try:
        found = collision_model(robot, collision_solids(robot, meshes))
        text = str(found)
    except (ValueError, RuntimeError):
        found, text = CollisionModel(), "MuJoCo cannot use the robot's shapes: the robot touches nothing"
    if not meshes:
        text += "; reading its meshes takes too long or fails"
    finding = Finding("note", "contacts", text)
    report = replace(robot.report, findings=(*robot.report.findings, finding))
    return replace(robot, collision=found, report=report)

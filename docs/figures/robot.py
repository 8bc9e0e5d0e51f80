"""A robot as data for a browser: its mechanics, its limits, and what is drawn of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from docs.figures.pack import Pack, plain
from robots import PlantSettings, Robot
from robots.shapes import Shape, link_shapes
from robots.simplify import simplify
from robots.truth import inertial, joint_axis, pose, true_model

FACES = 16_000
"""Triangles of a robot, at most."""
_GRID = 1e-4
"""m: coordinates of what is drawn are multiples of it."""


def robot_script(robot: Robot, name: str) -> str:
    """Returns the script that gives a robot to the page."""
    pack = Pack()
    return pack.script(name, mechanics(robot) | {"shapes": _drawn(robot, pack)})


def mechanics(robot: Robot) -> dict[str, Any]:
    """Returns bodies, solids and limits of the nominal robot, in the order and with the numbers of
    `robots.mechanics.model`. SI units; quaternions w x y z; None: no limit."""
    model = true_model(robot, PlantSettings())
    bodies = []
    for joint in range(1, model.njoints):
        prismatic, axis = joint_axis(model, joint)
        mass, lever, inertia = inertial(model.inertias[joint])
        placed = {key: value.tolist() for key, value in pose(model.jointPlacements[joint]).items()}
        bodies.append(
            {"parent": model.parents[joint], **placed, "mass": mass, "ipos": lever.tolist()}
            | {"inertia": inertia, "prismatic": prismatic, "axis": axis.tolist()}
        )
    tip = model.frames[robot.frame_id(robot.tip)]
    solids = [
        {"joint": solid.joint, "kind": solid.kind, "size": solid.size, "points": solid.points}
        | {"pos": solid.position, "quat": solid.quaternion}
        for solid in robot.collision.solids
    ]
    return {
        "name": robot.name,
        "joints": list(robot.joint_names),
        "bodies": bodies,
        "tip": {"joint": tip.parentJoint, "pos": tip.placement.translation.tolist()},
        "gravity": model.gravity.linear.tolist(),
        "solids": solids,
        "excluded": [[pair.first, pair.second] for pair in robot.collision.excluded],
        "home": robot.home.tolist(),
        **{name: plain(getattr(robot, name)) for name in ("tau_limit", "v_limit", "q_lower", "q_upper")},
    }


def _drawn(robot: Robot, pack: Pack) -> list[dict[str, Any]]:
    shapes = link_shapes(robot)
    share = min(1.0, FACES / max(1, sum(len(shape.faces) for shape in shapes)))
    return [_coarse(shape, share, pack) for shape in shapes if len(shape.faces)]


def _coarse(shape: Shape, share: float, pack: Pack) -> dict[str, Any]:
    vertices, faces = shape.vertices.astype(float), shape.faces
    vertices, faces = simplify(vertices, faces, max(60, round(share * len(faces))))
    counted = np.uint16 if len(vertices) < 65536 else np.uint32
    grid = np.clip(np.round(vertices / _GRID), -32768, 32767).astype("<i2")
    return {
        "joint": shape.joint,
        "colour": list(shape.colour),
        "grid": _GRID,
        "wide": counted is np.uint32,
        "vertices": pack.add(grid.tobytes()),
        "faces": pack.add(faces.astype(np.dtype(counted).newbyteorder("<")).tobytes()),
    }

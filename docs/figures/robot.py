"""A robot as data for a browser: its mechanics, its limits and its drawn shapes."""

from __future__ import annotations

from typing import Any

import numpy as np

from docs.figures.pack import Pack, plain
from robots import PlantSettings, Robot
from robots.joints import joint_axis
from robots.meshes.simplify import simplify
from robots.shapes.link_shapes import Shape, link_shapes
from robots.truth import inertial, true_model

FACES = 16_000
"""Largest number of triangles of a robot."""
_GRID = 1e-4
"""The coordinates of drawn shapes are multiples of this length, m."""


def robot_script(robot: Robot, name: str) -> str:
    """Returns the script that gives a robot to the page."""
    pack = Pack()
    return pack.script(name, mechanics(robot) | {"shapes": _drawn(robot, pack)})


def mechanics(robot: Robot) -> dict[str, Any]:
    """Returns inertia and limits of the nominal robot in SI units. None means no limit. `model_text` has the
    rest.

    `reach` is the sum of the distances from joint to joint, m; `planar` is true if all joints lie in one
    horizontal plane."""
    model = true_model(robot, PlantSettings())
    bodies = []
    for joint in range(1, model.njoints):
        mass, lever, inertia = inertial(model.inertias[joint])
        bodies.append(
            {"mass": mass, "ipos": lever.tolist(), "inertia": inertia}
            | {"prismatic": joint_axis(model, joint)[0], "armature": float(model.armature[joint - 1])}
        )
    tip = model.frames[robot.frame_id(robot.tip)]
    places = np.array([model.jointPlacements[joint].translation for joint in range(1, model.njoints)])
    return {
        "name": robot.name,
        "joints": list(robot.joint_names),
        "bodies": bodies,
        "reach": float(np.linalg.norm(places, axis=1).sum()),
        "planar": bool(np.abs(places[:, 2]).max() < 1e-6),
        "tip": {"joint": tip.parentJoint, "pos": tip.placement.translation.tolist()},
        "gravity": model.gravity.linear.tolist(),
        **{name: plain(getattr(robot, name)) for name in ("tau_limit", "v_limit", "q_lower", "q_upper")},
    }


def _drawn(robot: Robot, pack: Pack) -> list[dict[str, Any]]:
    shapes = link_shapes(robot)
    share = min(1.0, FACES / max(1, sum(len(shape.faces) for shape in shapes)))
    return [_coarse(shape, share, pack) for shape in shapes if len(shape.faces)]


def _coarse(shape: Shape, share: float, pack: Pack) -> dict[str, Any]:
    vertices, faces = shape.vertices.astype(float), shape.faces
    vertices, faces = simplify(vertices, faces, max(60, round(share * len(faces))))
    assert len(vertices) < 65536  # FACES triangles have fewer corners
    grid = np.clip(np.round(vertices / _GRID), -32768, 32767).astype("<i2")
    return {
        "joint": shape.joint,
        "colour": f"#{bytes(shape.colour[:3]).hex()}",
        "grid": _GRID,
        "vertices": pack.add(grid.tobytes()),
        "faces": pack.add(faces.astype("<u2").tobytes()),
    }

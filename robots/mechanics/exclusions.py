"""The pairs of bodies of a robot whose contact is left out, found by its geometry at home and in random
postures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np

from robots.collision import base_joint
from robots.geometry import CollisionModel, Excluded, Solid, Why
from robots.inertia import sample_configurations
from robots.joints import coupling, joint_axis
from robots.mechanics.model import compiled
from robots.robot import Robot
from robots.settings import PlantSettings

NEAR = 2e-3
"""Two bodies that are nearer than this at home, m, count as touching there."""
SAMPLES = 300
Bodies = tuple[int, int]
_SAME_AXIS = 0.999  # cosine between the axes of two slides of a telescope
OFTEN = 0.9
"""A pair is excluded if it touches in more than this share of random postures."""


def collision_model(
    robot: Robot,
    solids: tuple[Solid, ...],
    hollow: tuple[tuple[str, str], ...] = (),
    near_home: float = NEAR,
) -> CollisionModel:
    """Returns the solids with the pairs of bodies to leave out: neighbours, segments of a telescope, pairs of
    links that are `hollow`, pairs that are nearer than a distance (m) at home, and pairs that touch in nearly
    every posture within the joints' limits."""
    names: dict[int, str] = {}
    for solid in solids:
        names.setdefault(solid.joint, solid.link)

    def pair(first: int, second: int, why: Why) -> Excluded:
        return Excluded(first, second, (names[first], names[second]), why)

    near = [
        pair(other, joint, "neighbours")
        for joint in range(1, robot.model.njoints)
        for other in _neighbours(robot, joint)
        if joint in names and other in names
    ]
    for links in hollow:
        first, second = sorted(robot.model.frames[robot.frame_id(link)].parentJoint for link in links)
        near.append(pair(first, second, "hollow"))
    model = CollisionModel(solids, tuple(near))
    home = sorted(touching(replace(robot, collision=model), robot.home, near_home))
    model = replace(model, excluded=(*model.excluded, *(pair(a, b, "home") for a, b in home)))
    counts = Counter(each for found in touching_often(replace(robot, collision=model)) for each in found)
    always = sorted(each for each, count in counts.items() if count > OFTEN * SAMPLES)
    return replace(model, excluded=(*model.excluded, *(pair(a, b, "always") for a, b in always)))


def _neighbours(robot: Robot, joint: int) -> Iterator[int]:
    """Yields the body that carries a joint, and for a segment of a telescope, whose segments slide in one
    another along the same axis, the bodies of all segments below it and the one that carries them."""
    model = robot.model
    below = model.parents[joint]
    yield below
    slides, axis = joint_axis(model, joint)
    while slides and below > 0:
        axis = model.jointPlacements[joint].rotation @ axis  # in the frame of the joint below
        slides, along = joint_axis(model, below)
        if not slides or abs(float(axis @ along)) < _SAME_AXIS:
            return
        joint, below = below, model.parents[below]
        yield below


def touching(robot: Robot, q: np.ndarray, margin: float = 0.0) -> set[Bodies]:
    """Returns the pairs of bodies, except excluded pairs, that are nearer than a margin (m) at q (n,), rad.
    The base has the index 0."""
    return next(_touches(robot, np.array([q]), margin))


def touching_often(robot: Robot) -> list[set[Bodies]]:
    """Returns, for each of 300 random postures within the joints' limits, the pairs of bodies that touch,
    except excluded pairs."""
    lower, upper = np.maximum(robot.q_lower, -np.pi), np.minimum(robot.q_upper, np.pi)
    return list(_touches(robot, sample_configurations(lower, upper, SAMPLES, 0)))


def _touches(robot: Robot, postures: np.ndarray, margin: float = 0.0) -> Iterator[set[Bodies]]:
    # Each solid has half the margin: MuJoCo adds the margins of both solids.
    model = compiled(robot, PlantSettings(contacts=True), margin=0.5 * margin)
    data = mujoco.MjData(model)
    joints = [solid.joint for solid in robot.collision.solids]
    for joint_positions in postures @ coupling(robot.model).T:
        data.qpos[:] = joint_positions
        mujoco.mj_fwdPosition(model, data)
        pairs = (sorted(joints[geom] for geom in contact.geom) for contact in data.contact)
        yield {(a, b) for a, b in pairs}


def lowest(robot: Robot) -> tuple[float | None, float | None]:
    """Returns two heights at home, m: of the lowest point of the fixed or mobile base, and of the lowest
    point of all other bodies. A height is None if there is no solid."""
    model = compiled(robot, PlantSettings(contacts=True))
    data = mujoco.MjData(model)
    data.qpos[:] = coupling(robot.model) @ robot.home
    mujoco.mj_fwdPosition(model, data)
    standing = base_joint(robot)
    found: dict[bool, list[float]] = {True: [], False: []}
    for geom, solid in enumerate(robot.collision.solids):
        found[solid.joint <= standing].append(_bottom(model, data, geom))
    base, rest = (min(found[key], default=None) for key in (True, False))
    return base, rest


def _bottom(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Returns the height of the lowest point of a geometry, or of the box around it, m."""
    R = data.geom_xmat[geom].reshape(3, 3)
    middle, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        corners = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
        return float((data.geom_xpos[geom, 2] + corners @ R[2]).min())
    return float(data.geom_xpos[geom, 2] + R[2] @ middle - np.abs(R[2]) @ half)

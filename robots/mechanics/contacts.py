"""Reads the contacts of a robot from MuJoCo's data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from robots.mechanics.model import label
from robots.robot import Robot
from robots.world import World


class Touch(NamedTuple):
    """The contacts of a robot with itself or with objects during a step of the plant. depth: m, the deepest
    penetration. force: N, the largest force between two links, or between a link and an object. The largest
    values at the last stages of all internal steps are used; they are 0 without a contact.
    """

    depth: float = 0.0
    force: float = 0.0


@dataclass(frozen=True, eq=False)
class Contact:
    """One point of contact: the names of two links, or of an object and a link; the position in the world,
    (3,) m; the force on the second link in world axes, (3,) N; and the depth, m."""

    between: tuple[str, str]
    position: np.ndarray
    force: np.ndarray
    depth: float


def contacts(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, world: World) -> tuple[Contact, ...]:
    """Returns the points at which the robot touches itself or an object. `data` must contain the
    accelerations, which determine the forces. Contacts between objects are left out."""
    own, found = len(robot.collision.solids), []
    force = np.zeros(6)
    for index in range(data.ncon):
        contact = data.contact[index]
        first, second = (int(geom) for geom in contact.geom)
        if min(first, second) >= own or contact.efc_address < 0:
            continue
        mujoco.mj_contactForce(model, data, index, force)
        turned = contact.frame.reshape(3, 3).T @ force[:3]
        if second >= own:
            first, second, turned = second, first, -turned
        between = label(robot, world, first), label(robot, world, second)
        found.append(Contact(between, contact.pos.copy(), turned, max(0.0, -float(contact.dist))))
    return tuple(found)


def touch_of(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot) -> Touch:
    """Returns the deepest penetration, and the largest force between two bodies. The force is the sum over
    all points of contact of the two bodies."""
    own, depth = len(robot.collision.solids), 0.0
    forces: dict[tuple[int, int], list[np.ndarray]] = {}
    every, found = np.zeros((data.ncon, 6)), data.contact
    bodies, distances, frames = model.geom_bodyid[found.geom], found.dist, found.frame
    for index, (geoms, address) in enumerate(zip(found.geom, found.efc_address, strict=True)):
        if geoms.min() >= own or address < 0:
            continue
        mujoco.mj_contactForce(model, data, index, every[index])
        depth = max(depth, -float(distances[index]))
        force = every[index, :3] @ frames[index].reshape(3, 3)
        forces.setdefault((bodies[index, 0], bodies[index, 1]), []).append(force)
    sums = (each[0] if len(each) == 1 else np.sum(each, axis=0) for each in forces.values())
    return Touch(depth, max((float(np.sqrt(force @ force)) for force in sums), default=0.0))

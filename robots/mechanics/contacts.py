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
    """How a robot touched something during a step of the plant, its own links included.

    depth: m, the deepest penetration. force: N, the largest force between two links, or a link and an object.
    Both are the largest of the internal steps, and 0 without a contact.
    """

    depth: float = 0.0
    force: float = 0.0


@dataclass(frozen=True, eq=False)
class Contact:
    """One point of contact: the names of the two links, or of an object and a link; position (3,) m in the
    world; force (3,) N, world axes, on the second of them; depth m."""

    between: tuple[str, str]
    position: np.ndarray
    force: np.ndarray
    depth: float


def contacts(model: mujoco.MjModel, data: mujoco.MjData, robot: Robot, world: World) -> tuple[Contact, ...]:
    """Returns the points at which the robot touches itself or an object. data: with accelerations, which
    determine the forces. Contacts of objects with each other are left out."""
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


def touch_of(found: tuple[Contact, ...]) -> Touch:
    """Returns the deepest penetration, and the largest force between two things, the sum over their
    points."""
    forces: dict[tuple[str, str], np.ndarray] = {}
    for each in found:
        forces[each.between] = forces.get(each.between, np.zeros(3)) + each.force
    depth = max((each.depth for each in found), default=0.0)
    return Touch(depth, max((float(np.linalg.norm(force)) for force in forces.values()), default=0.0))

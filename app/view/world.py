"""The objects that a robot can touch, and the contact forces."""

from __future__ import annotations

import numpy as np
import viser

from app.html.palette import BAD, RGB
from app.link.messages import ContactPoint
from robots.world import Ball, Box, Floor, Post, Thing, World

_STATIC: RGB = (160, 150, 140)
_FREE: RGB = (70, 150, 190)
_PER_NEWTON = 1e-3  # m: length of an arrow per newton
_LONGEST, _SHORTEST = 0.35, 0.02  # m
_HIDDEN = np.zeros((1, 2, 3), np.float32)


class WorldView:
    """The objects of a scene. A floor is drawn by the grid of the page."""

    def __init__(self, scene: viser.SceneApi, world: World) -> None:
        self._free: list[viser.SceneNodeHandle] = []
        for index, thing in enumerate(world):
            node = _drawn(scene, f"/world/{index}", thing)
            if node is not None and thing.free:
                self._free.append(node)

    def follow(self, poses: np.ndarray) -> None:
        """Moves the free objects: poses (k, 7), m and quaternion (w, x, y, z), in their order."""
        for node, pose in zip(self._free, poses, strict=False):
            if not np.allclose(pose, [*node.position, *node.wxyz], rtol=0.0, atol=1e-4):
                node.position, node.wxyz = pose[:3], pose[3:]


def _drawn(scene: viser.SceneApi, name: str, thing: Thing) -> viser.SceneNodeHandle | None:
    pose, colour = np.array(thing.pose), _FREE if thing.free else _STATIC
    position, wxyz = pose[:3], pose[3:]
    match thing.shape:
        case Ball(_, _, radius):
            return scene.add_icosphere(name, radius, colour, position=position, cast_shadow=False)
        case Box(_, _, size):
            return scene.add_box(
                name, colour, dimensions=size, position=position, wxyz=wxyz, cast_shadow=False
            )
        case Post(_, _, height, radius):
            return scene.add_cylinder(name, radius, height, colour, position=position, cast_shadow=False)
        case Floor():
            return None


class ContactView:
    """An arrow for each point of contact, in the direction of the force on the robot. Its length is 1 mm per
    newton, at most 35 cm. The strongest force has a label."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._shown: tuple[ContactPoint, ...] = ()
        self._arrows = scene.add_arrows(
            "/contacts", _HIDDEN, BAD, shaft_radius=0.006, head_radius=0.016, head_length=0.035, visible=False
        )
        self._label = scene.add_label("/contact_label", "", visible=False)

    def show(self, contacts: tuple[ContactPoint, ...]) -> None:
        """Draws the arrows of the present contacts."""
        if contacts == self._shown:
            return
        self._shown = contacts
        self._arrows.visible = self._label.visible = bool(contacts)
        if not contacts:
            return
        self._arrows.points = np.array([_arrow(each) for each in contacts], np.float32)
        strongest = max(contacts, key=_strength)
        pair = [each for each in contacts if each.between == strongest.between]
        total = float(np.linalg.norm(np.sum([each.force for each in pair], axis=0)))
        self._label.text = f"{strongest.between[1]} – {strongest.between[0]}: {total:.0f} N"
        self._label.position = _arrow(strongest)[1]


def _strength(contact: ContactPoint) -> float:
    return float(np.linalg.norm(contact.force))


def _arrow(contact: ContactPoint) -> np.ndarray:
    """Start and end of a contact's arrow, (2, 3) m."""
    force, at = np.array(contact.force), np.array(contact.position)
    strength = _strength(contact)
    length = float(np.clip(_PER_NEWTON * strength, _SHORTEST, _LONGEST))
    return np.array([at, at + length * force / max(strength, 1e-9)])

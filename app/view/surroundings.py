"""What stands around a robot: the floor with the robot's shadow, people with balls, the reach of its arm, the
objects that it can touch, and the contact forces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import viser

from app.html.palette import AXES, BAD, BOUND, JOINTS, RGB
from app.link.messages import ContactPoint, Person
from app.view.trails import NOTHING, segments
from robots import Robot
from robots.collision import WorldShape
from robots.world import Ball, Box, Floor, Post, Thing, World

_BALL: RGB = (245, 190, 30)
_BALL_RADIUS = 0.06  # m
_POINTS = 96
_TALL, _WIDE, _HEAD = 1.25, 0.17, 0.12  # m, of a person


class Ground:
    """The floor with the axes x and y of the world, and on it a shadow: discs below points along the arm. The
    higher a point is, the larger and fainter is its disc. Shadows by lights would triple the time in which a
    browser draws."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, room: np.ndarray) -> None:
        """room: the points (k, 3), m, that the robot will reach."""
        far = float(np.abs(room[:, :2]).max(initial=0.0))
        cell, section = (0.1, 0.5) if far == 0.0 else (0.5, 1.0)
        fade = 4.0 if far == 0.0 else 3.0 * math.ceil(far + 1.0)
        self._grid = scene.add_grid(
            "/floor",
            infinite_grid=True,
            cell_size=cell,
            section_size=section,
            fade_distance=fade,
            fade_from="origin",
        )
        for name, along, colour in zip("xy", section * np.eye(3), AXES, strict=False):
            line = np.array([[0.0 * along, along]], np.float32)
            scene.add_line_segments(f"/axes/{name}", line, colour, thickness=0.008 * section)
            scene.add_label(f"/axes/{name}_name", name, position=1.05 * along, anchor="center-center")
        parents = [(parent, joint) for joint, parent in enumerate(robot.model.parents) if parent]
        tip = robot.model.frames[robot.frame_id(robot.tip)].parentJoint
        # `move` gets the poses of the joints 1, 2, …, and of the tip.
        ends = np.array([*parents, (tip, robot.model.njoints)]) - 1
        share = np.linspace(0.0, 1.0, _DISCS, endpoint=False)[None, :, None]
        self._ends, self._share = ends, share
        count = len(ends) * _DISCS * len(_RINGS)
        turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
        rim = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
        faces = [(0, 1 + k, 1 + (k + 1) % len(turn)) for k in range(len(turn))]
        self._discs = scene.add_batched_meshes_simple(
            "/shadow",
            np.vstack([np.zeros(3), rim]).astype(np.float32),
            np.array(faces, np.uint32),
            np.tile((1.0, 0.0, 0.0, 0.0), (count, 1)).astype(np.float32),
            np.zeros((count, 3), np.float32),
            batched_scales=np.ones(count, np.float32),
            batched_colors=(0, 0, 0),
            batched_opacities=np.zeros(count, np.float32),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._shown = self._heights = np.full(1, np.nan)

    def paint(self, dark: bool) -> None:
        """Sets the colours of the grid lines, which are less conspicuous than the robot on every
        background."""
        cell, section = (70, 105) if dark else (215, 175)
        self._grid.cell_color = (cell, cell, cell)
        self._grid.section_color = (section, section, section)

    def move(self, poses: np.ndarray) -> None:
        """poses: (J, 7), position, m, and quaternion of all joints and of the tip."""
        start, end = poses[self._ends[:, :1], :3], poses[self._ends[:, 1:], :3]
        points = (start + self._share * (end - start)).reshape(-1, 3)
        if not (np.abs(points - self._shown) <= _SHADOW_STILL).all():
            self._shown = points
            at = np.tile(points, (len(_RINGS), 1))
            at[:, 2] = _APART * np.arange(1, len(at) + 1)
            self._discs.batched_positions = at.astype(np.float32)
        height = np.maximum(points[:, 2], 0.0)
        if not (np.abs(height - self._heights) <= _SAME_HEIGHT).all():
            self._heights, radius = height, _DISC + _WIDER * height
            self._discs.batched_scales = np.outer(_RINGS, radius).ravel().astype(np.float32)
            faint = _DARK * (_DISC / radius) ** 2
            self._discs.batched_opacities = np.tile(faint, len(_RINGS)).astype(np.float32)


_DISCS = 3  # below each part of the arm
_RINGS = (0.6, 1.0)  # radii of the discs at one point, for a soft edge
_DISC, _WIDER = 0.08, 0.12  # m, radius at the floor; its growth with the height
_DARK = 0.1  # opacity of a disc at the floor
_SHADOW_STILL, _SAME_HEIGHT = 4e-3, 2e-2  # m, of points along the arm; smaller changes are not sent
_APART = 2e-4  # m, between two discs, which would flicker at the same height


class People:
    """Figures of people with an extended hand, and the balls that they have received."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._shown: list[tuple[Person, viser.SceneNodeHandle]] = []

    def show(self, people: tuple[Person, ...]) -> None:
        if people == tuple(person for person, _ in self._shown):
            return
        before = self._shown
        self._shown = []
        for index, person in enumerate(people):
            if index < len(before) and before[index][0] == person:
                self._shown.append(before[index])
                continue
            if index < len(before):
                before[index][1].remove()
            self._shown.append((person, self._draw(index, person)))

    def _draw(self, index: int, person: Person) -> viser.SceneNodeHandle:
        scene, node, colour = self._scene, f"/person/{index}", JOINTS[(index + 3) % len(JOINTS)]
        place = np.array([*person.place, 0.0])
        figure = scene.add_frame(node, show_axes=False, position=place)
        scene.add_cylinder(f"{node}/body", _WIDE, _TALL, color=colour, position=(0, 0, 0.5 * _TALL))
        scene.add_icosphere(
            f"{node}/head", radius=_HEAD, color=(225, 190, 165), position=(0, 0, _TALL + 0.8 * _HEAD)
        )
        shoulder, hand = np.array([0.0, 0.0, 0.85 * _TALL]), np.array(person.hand) - place
        arm = np.array([[shoulder, hand - [0.0, 0.0, _BALL_RADIUS]]], np.float32)
        scene.add_line_segments(f"{node}/arm", arm, colour, thickness=0.06)
        for k in range(person.balls):
            # A pile of balls on the floor in front of the person.
            away = 0.35 * hand[:2] / max(float(np.linalg.norm(hand[:2])), 1e-6)
            beside = 0.13 * (k - 0.5 * (person.balls - 1)) * np.array([-away[1], away[0]]) / 0.35
            scene.add_icosphere(
                f"{node}/got{k}", radius=_BALL_RADIUS, color=_BALL, position=(*(away + beside), _BALL_RADIUS)
            )
        return figure


class Carried:
    """The ball in the robot's hand."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._ball = scene.add_icosphere("/carried", radius=_BALL_RADIUS, color=_BALL, visible=False)

    def follow(self, tip: np.ndarray, carried: bool) -> None:
        """tip (3,): the position of the hand, m."""
        self._ball.visible = carried
        if carried and not np.allclose(tip, self._ball.position, rtol=0.0, atol=1e-4):
            self._ball.position = tip


class ReachCircle:
    """The arm's reach as a circle on the floor around the base. If a goal of the hand is outside the circle,
    the base must move."""

    def __init__(self, scene: viser.SceneApi, joint: int, radius: float) -> None:
        """joint: number, 1 … n, of the base's last joint; the circle moves with the frame of this joint;
        radius: m."""
        angles = np.linspace(0.0, 2 * np.pi, _POINTS + 1)
        circle = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros_like(angles)], axis=1)
        self._circle = scene.add_line_segments(
            f"/robot/{joint}/reach", segments(circle), BOUND, thickness=0.012, position=(0.0, 0.0, 0.006)
        )

    def show(self, on: bool) -> None:
        self._circle.visible = on


_STATIC: RGB = (160, 150, 140)
_FREE: RGB = (70, 150, 190)
_PER_NEWTON = 1e-3  # m: length of an arrow per newton
_LONGEST, _SHORTEST = 0.35, 0.02  # m


class WorldView:
    """The objects of a scene. A floor is drawn by the grid of the page."""

    def __init__(self, scene: viser.SceneApi, world: World) -> None:
        self._free: list[viser.SceneNodeHandle] = []
        for index, thing in enumerate(world):
            if isinstance(thing.shape, Floor):
                continue
            colour = _FREE if thing.free else _STATIC
            node = solid(scene, f"/world/{index}", thing.shape, colour, **placed(thing.shape))
            if thing.free:
                self._free.append(node)

    def follow(self, poses: np.ndarray) -> None:
        """Moves the free objects: poses (k, 7), m and quaternion (w, x, y, z), in their order."""
        for node, pose in zip(self._free, poses, strict=False):
            if not np.allclose(pose, [*node.position, *node.wxyz], rtol=0.0, atol=1e-4):
                node.position, node.wxyz = pose[:3], pose[3:]


def solid(
    scene: viser.SceneApi, name: str, shape: Ball | Box | Post, colour: RGB, **more: Any
) -> viser.SceneNodeHandle:
    """Draws an object about its middle. more: its place, see `placed`, and its opacity."""
    match shape:
        case Ball(_, _, radius):
            return scene.add_icosphere(name, radius, colour, **more)
        case Box(_, _, size):
            return scene.add_box(name, colour, dimensions=size, **more)
        case Post(_, _, height, radius):
            return scene.add_cylinder(name, radius, height, colour, **more)


def placed(shape: WorldShape) -> dict[str, Any]:
    """Returns the position and the rotation of an object's middle, as attributes of a node."""
    x, y, z, *wxyz = Thing(shape).pose
    return {"position": (x, y, z), "wxyz": wxyz}


class ContactView:
    """An arrow for each point of contact, in the direction of the force on the robot. Its length is 1 mm per
    newton, at most 35 cm. The strongest force has a label."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._shown: tuple[ContactPoint, ...] = ()
        self._arrows = scene.add_arrows(
            "/contacts", NOTHING, BAD, shaft_radius=0.006, head_radius=0.016, head_length=0.035, visible=False
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

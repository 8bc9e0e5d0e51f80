"""Pulling a link with the mouse: a spring between the grabbed point of the link and the pointer."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import viser
import viser.transforms as vtf

from app.html.palette import BAD
from app.tab.mirror import Send
from app.view.robot import RobotView
from app.view.trails import NOTHING
from lessons.events import Push
from robots import PlantSettings, Robot
from robots.truth import true_model

_STIFF = 7.0  # N/m per kg of robot: a 30 kg arm feels 60 N when pulled 30 cm away
_MOST = 3.5  # N per kg of robot
_HELD = 0.15  # s: duration of a push if the page does not renew it


@dataclass(frozen=True, eq=False)
class Grip:
    """joint: 1 … J − 1, of the grabbed link; at (3,): the grabbed point in the joint's axes, m; hand (3,):
    position of the pointer in the world, m."""

    joint: int
    at: np.ndarray
    hand: np.ndarray


class Pull:
    """Callbacks store the position of the pointer; `follow` posts the force, about thirty times per
    second."""

    def __init__(self, scene: viser.SceneApi, view: RobotView, robot: Robot, post: Send) -> None:
        self._robot, self._post = robot, post
        self._mass = sum(float(inertia.mass) for inertia in robot.model.inertias)
        self._grip: Grip | None = None
        self._pulling: int | None = None
        self._poses = np.zeros((0, 7))
        self._arrow = scene.add_arrows(
            "/pull",
            NOTHING,
            BAD,
            shaft_radius=0.006,
            head_radius=0.018,
            head_length=0.04,
            visible=False,
        )
        self._label = scene.add_label("/pull_label", "", visible=False)
        self._links = [(joint, mesh) for joint, mesh in view.links if joint]
        self._on = False

    def _switch(self, on: bool) -> None:
        # A draggable link hides objects behind it from the mouse, including the target's arrows.
        self._on = on
        for joint, mesh in self._links:
            if on:
                self._attach(joint, mesh)
            else:
                mesh.remove_drag_callback()

    def _attach(self, joint: int, mesh: viser.MeshHandle) -> None:
        @mesh.on_drag("left")
        async def _(event: viser.SceneNodeDragEvent[viser.MeshHandle]) -> None:
            if event.phase == "end" or joint > len(self._poses):
                self._grip = None
                return
            hand = np.array(event.end_position)
            grip = self._grip
            if event.phase == "start" or grip is None or grip.joint != joint:
                pose = self._poses[joint - 1]
                turn = vtf.SO3(pose[3:]).as_matrix()
                at = turn.T @ (np.array(event.start_position) - pose[:3])
            else:
                at = grip.at
            self._grip = Grip(joint, at, hand)

    def follow(self, poses: np.ndarray, plant: PlantSettings, running: bool, on: bool) -> None:
        """poses (J, 7): the present poses; plant: contains the link's mass; on: whether links can be
        pulled. While paused no force is posted."""
        self._poses = poses
        if on != self._on:
            self._switch(on)
        grip = self._grip if on else None
        if grip is None or not running:
            if self._pulling is not None:
                self._post(Push(self._robot.model.names[self._pulling], seconds=1e-3))
                self._pulling = None
            if self._arrow.visible:
                self._arrow.visible = self._label.visible = False
            return
        point, force = pulled(grip, poses, self._mass)
        self._pulling = grip.joint
        self._post(push_at(self._robot, plant, grip.joint, poses[grip.joint - 1], point, force))
        self._arrow.points = np.array([[point, grip.hand]], np.float32)
        self._arrow.visible = self._label.visible = True
        self._label.position = grip.hand
        self._label.text = f"{np.linalg.norm(force):.0f} N"


def pulled(grip: Grip, poses: np.ndarray, mass: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the attachment point of the spring (3,), m, and the spring's force (3,), N, in world axes.
    mass: of the robot, kg."""
    pose = poses[grip.joint - 1]
    point = pose[:3] + vtf.SO3(pose[3:]).as_matrix() @ grip.at
    force = _STIFF * mass * (grip.hand - point)
    size = float(np.linalg.norm(force))
    return point, force * min(1.0, _MOST * mass / size) if size > 0 and math.isfinite(size) else 0.0 * point


def push_at(
    robot: Robot, plant: PlantSettings, joint: int, pose: np.ndarray, point: np.ndarray, force: np.ndarray
) -> Push:
    """Converts a force (N) at a point of a link (m) to force and torque at the link's centre of mass.

    Args:
        robot: the robot.
        plant: contains the robot's true masses.
        joint: the number, 1 … J − 1, of the joint that moves the link.
        pose: the pose (7,) of the joint's frame.
        point: the point (3,) in the world, m.
        force: the force (3,) in world axes, N.
    """
    lever = true_model(robot, plant).inertias[joint].lever
    centre = pose[:3] + vtf.SO3(pose[3:]).as_matrix() @ lever
    torque = np.cross(point - centre, force)
    return Push(
        robot.model.names[joint], tuple(float(x) for x in force), tuple(float(x) for x in torque), _HELD
    )

"""The robot's links, moved by poses from the simulation."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import viser

from robots import Robot
from robots.shapes import link_shapes


class RobotView:
    """One frame per joint with the shapes it carries."""

    def __init__(self, scene: viser.SceneApi, robot: Robot) -> None:
        shapes = link_shapes(robot)
        self._frames = [
            scene.add_frame(f"/robot/{joint}", show_axes=False) for joint in range(1, robot.n + 1)
        ]
        for index, shape in enumerate(shapes):
            scene.add_mesh_simple(
                f"/robot/{shape.joint or 'base'}/shape{index}",
                shape.vertices,
                shape.faces,
                color=shape.colour,
            )
        points = np.concatenate([shape.vertices for shape in shapes]) if shapes else np.zeros((1, 3))
        self.size = float(np.ptp(points, axis=0).max())

    def move(self, poses: np.ndarray) -> None:
        """poses (n, 7): position, m, and quaternion wxyz per joint."""
        for frame, pose in zip(self._frames, poses, strict=False):
            frame.position = pose[:3]
            frame.wxyz = pose[3:]


def camera_for(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """(position, look_at) from which the whole workspace of a robot is seen."""

    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, robot.home)
    joints = np.array([data.oMi[j].translation for j in range(1, robot.model.njoints)])
    tip = data.oMf[robot.frame_id(robot.tip)].translation
    points = np.vstack([np.zeros(3), joints, tip])
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    length = float(np.sum(np.linalg.norm(np.diff(points[1:], axis=0), axis=1)))
    reach = max(0.4, length)
    planar = float(np.ptp(points[:, 2])) < 0.05 * reach
    direction = np.array([0.25, -0.75, 1.6]) if planar else np.array([1.35, -1.35, 0.65])
    return middle + reach * direction, middle

"""A scene whose whole QP can be drawn in a plane: the increments of two joints, one knot ahead."""

from __future__ import annotations

import numpy as np

from himpc.stack import Level
from himpc.tasks import FramePosition, Joints
from lessons.scenes.hold import PLANAR3_PLANT
from lessons.scenes.torque_scene import TorqueScene
from lessons.settings.torque import TorqueSettings
from robots import load_robot


def planar3_plane() -> TorqueScene:
    """`planar3-plane`: the planar arm with N = 1. Its wrist is dragged along x, and two joints have fixed
    targets.

    Level 1 is the wrist's x (one coordinate), level 2 the angles of joints 1 and 2, level 3 holds joint 3.
    The wrist is where joint 3 sits, and M̄ is diagonal: neither of the first two levels uses joint 3, so the
    results of these levels lie in the plane of Δτ₁ and Δτ₂. The first two levels cannot both be met, and
    their conflict is always visible.
    """
    robot = load_robot("planar3", tip="link_3")
    first, second, third = robot.joint_names
    levels = (
        Level((FramePosition(name="reach", axes="x", K_p=100.0, K_v=20.0),)),
        Level((Joints(name="pose", joints=(first, second), K_p=50.0, K_v=15.0),), Q=(200.0, 50.0)),
        Level((Joints(name="wrist", joints=(third,), K_p=50.0, K_v=15.0),)),
    )
    return TorqueScene(
        name="planar3-plane",
        title="planar arm, one knot: level 1 pulls the wrist along x, level 2 keeps two joints",
        robot=robot,
        settings=TorqueSettings(stack=levels, M_bar=tuple(robot.M_bar), horizon=1, plant=PLANAR3_PLANT),
        references=lambda robot, stack: {},
        q_0=np.radians([20.0, 80.0, -60.0]),
        v_0=np.zeros(3),
        duration=3.0,
    )

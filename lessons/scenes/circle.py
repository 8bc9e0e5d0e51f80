"""RT4: the iiwa's circle of section VI."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from himpc.references import Circle, Hold, Phase, Reference, Sinusoid
from himpc.stack import Level, Stack
from himpc.tasks import FrameOrientation, FramePosition, Joints
from lessons.scene import Scene
from lessons.settings import SceneSettings
from robots import Robot, load_robot

OMEGA = 0.5 * np.pi
"""rad/s; RT4 repeats after 4 s."""


def iiwa14_circle() -> Scene:
    """`iiwa14-circle`: Table IV's gains, Q = 200, R = 10, N = 5, the paper's M̄, data-sheet limits, from rest.

    The paper prints z_d = 1.096 − 0.1(0.5πt); read as 1.096 − 0.1 sin(0.5πt), the only reading that gives
    its q₁ error. The reference starts with a velocity jump: look at errors after the first second.
    """
    robot = load_robot("iiwa14")
    levels = (
        Level((FramePosition(name="position", K_p=200.0, K_v=10.0),)),
        Level((FrameOrientation(name="orientation", K_p=50.0, K_v=5.0),)),
        Level((Joints(name="q1", joints=robot.joint_names[:1], K_p=50.0, K_v=5.0),)),
    )
    return Scene(
        name="iiwa14-circle",
        title="KUKA iiwa 14 on RT4 of the HIMPC paper",
        robot=robot,
        settings=SceneSettings(levels=levels, M_bar=tuple(robot.M_bar)),
        references=rt4,
        q_0=np.deg2rad([0.0, 60.0, 0.0, 60.0, 0.0, 0.0, 0.0]),
        v_0=np.zeros(robot.n),
        duration=4.0,
    )


def rt4(robot: Robot, stack: Stack) -> Mapping[str, Reference]:
    """Circle of radius 0.1 m (a tilted ellipse in 3-D), fixed orientation, q₁ = 90° − 90° cos ωt."""
    return {
        "position": Circle(
            centre=np.array([0.2637, 0.0, 1.096]),
            u=np.array([0.1, 0.0, 0.0]),
            w=np.array([0.0, -0.1, -0.1]),
            phase=Phase(OMEGA),
        ),
        "orientation": Hold(np.eye(3)),
        "q1": Sinusoid(np.array([np.pi / 2]), np.array([np.pi / 2]), Phase(OMEGA, offset=-np.pi / 2)),
    }

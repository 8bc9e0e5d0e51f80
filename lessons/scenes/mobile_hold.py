"""The mobile manipulator at torque level: HIMPC drives the base by forces."""

from __future__ import annotations

import numpy as np

from himpc.stack import Level
from himpc.tasks import FramePosition
from lessons.scenes.hold import DRAGGED, TOUCHING
from lessons.scenes.torque_scene import TorqueScene
from lessons.settings.torque import TorqueSettings
from robots import load_robot
from robots.floor import standing_floor


def ridgeback_hold() -> TorqueScene:
    """`ridgeback-ur10-hold`: EE position, then the position of the base; all other motion is damped.

    The base's M̄ is half its mass, and the base has lower gains than the arm. R weighs accelerations. As
    printed, R would weigh forces of the base in N and torques of the arm in N·m.
    """
    robot = load_robot("ridgeback-ur10")
    levels = (
        Level((FramePosition(name="ee", K_p=100.0, K_v=20.0),)),
        Level((FramePosition(name="base", frame="base", axes="xy", K_p=16.0, K_v=8.0),)),
    )
    return TorqueScene(
        name="ridgeback-ur10-hold",
        title="Ridgeback and UR10 under HIMPC: drag the targets of hand and base; the hand comes first",
        robot=robot,
        settings=TorqueSettings(
            stack=levels, M_bar=tuple(robot.M_bar), R_on="acceleration", limits=DRAGGED, plant=TOUCHING
        ),
        references=lambda robot, stack: {},
        q_0=robot.home,
        v_0=np.zeros(robot.n),
        world=standing_floor(robot),
    )

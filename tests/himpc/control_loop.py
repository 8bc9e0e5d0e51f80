"""Shared functions for tests of the controller in its loop: a stack for the iiwa, and references."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc import FrameOrientation, FramePosition, Joints, Level, Settings
from himpc.kinematics.configuration import Configuration
from himpc.references import Hold, Preview
from robots import Robot

Array = NDArray[np.float64]


def iiwa_settings(robot: Robot, **changes: Any) -> Settings:
    stack = (
        Level((FramePosition(name="position"),)),
        Level((FrameOrientation(name="orientation"),)),
        Level((Joints(name="q1", joints=robot.joint_names[:1]),)),
    )
    return Settings(**({"stack": stack, "M_bar": tuple(robot.M_bar)} | changes))


def holds(robot: Robot, N: int, T_s: float = 1e-3) -> dict[str, Preview]:
    """Returns previews of constant references at home."""
    configuration = Configuration(robot, robot.model.createData(), robot.home, np.zeros(robot.n))
    tip = configuration.placement()
    values = {"position": tip.translation, "orientation": tip.rotation, "q1": robot.home[:1]}
    return {name: Hold(value.copy()).preview(0.0, T_s, N) for name, value in values.items()}

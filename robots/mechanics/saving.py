"""Saves the plant's mechanics as a file that MuJoCo's C library reads."""

from __future__ import annotations

import mujoco
import numpy as np

from robots.mechanics.model import compiled
from robots.robot import Robot
from robots.settings import PlantSettings
from robots.world import World


def saved(robot: Robot, settings: PlantSettings, world: World, timestep: float) -> bytes:
    """Returns the content of an MJB file, for this version of MuJoCo.

    Args:
        robot, settings, world: as for `robots.Plant`. The file contains neither delay, lag and saturation of
            the motors nor the encoders.
        timestep: s.
    """
    model = compiled(robot, settings, world)
    model.opt.timestep = timestep
    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return content.tobytes()

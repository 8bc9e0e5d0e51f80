"""The robot and the scene most tests of the controller use."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from lessons.scenes.catalog import torque_scene
from lessons.scenes.torque_scene import TorqueScene
from robots import Robot, load_robot

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def iiwa() -> Robot:
    return load_robot("iiwa14")


@pytest.fixture(scope="module")
def iiwa_scene() -> TorqueScene:
    return torque_scene("iiwa14-hold")

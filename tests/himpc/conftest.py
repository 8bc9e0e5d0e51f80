"""The robot that most tests of the controller use."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from robots import Robot, load_robot

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def iiwa() -> Robot:
    return load_robot("iiwa14")

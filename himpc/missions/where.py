"""Positions and speeds of a robot's points, which the task manager receives at every control period."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from himpc.kinematics.configuration import Configuration
from himpc.tasks import Task

Array = NDArray[np.float64]


def where(at: Configuration, roles: Mapping[str, Task]) -> tuple[dict[str, Array], dict[str, float]]:
    """Returns the arguments `points` and `speeds` of `advanced`, by role.

    Args:
        at: the measured state.
        roles: the task of each role.

    Returns:
        the position (m,) in m, or the rotation matrix (3, 3), of each role's point, and the speed of each
        point in m/s or rad/s.
    """
    points = {name: task.value(at) for name, task in roles.items()}
    speeds = {name: float(np.linalg.norm(task.jacobian(at)[0] @ at.v)) for name, task in roles.items()}
    return points, speeds

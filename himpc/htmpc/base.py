"""The mobile base: G(q) of (4), and the joints of the base."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from robots import InputError, Robot
from robots.per_robot import per_robot

Array = NDArray[np.float64]
Base = Literal["holonomic", "unicycle"]
UNICYCLE = (
    "base is 'unicycle': its G(q) depends on the heading, and the condensed prediction needs G = I; "
    "describe a holonomic base by two prismatic joints and one revolute joint instead"
)


def G(robot: Robot, q: Array, base: Base = "holonomic") -> Array:
    """Returns the matrix G(q) of (4), (n, n), with q̇ = G(q) v.

    Each joint of these robots has its own coordinate. A holonomic base consists of two prismatic joints along
    world axes and a revolute joint. Its velocities are world velocities, and G is the identity, as for an
    arm.

    Raises:
        InputError: the base is a unicycle, whose forward speed acts along its heading.
    """
    if base == "unicycle":
        raise InputError(UNICYCLE)
    return np.eye(robot.n)


@per_robot
def base_joints(robot: Robot) -> tuple[int, ...]:
    """Returns the columns of the joints of a mobile base: the unbounded joints at the root of the tree."""
    count = 0
    for joint in range(1, robot.n + 1):
        chained = robot.model.parents[joint] == joint - 1 and robot.joints[joint - 1] == joint
        if not chained or np.isfinite(robot.q_lower[joint - 1]) or np.isfinite(robot.q_upper[joint - 1]):
            break
        count = joint
    return tuple(range(count)) if count >= 3 else ()

"""The teacher's robot as a few numbers, for pages that draw it without a library."""

from __future__ import annotations

from typing import Any

import numpy as np

from robots import Robot
from robots.covering.cover_of import cover_of

Shape = dict[str, Any]


def shape_of(robot: Robot) -> Shape:
    """Returns the capsules of a robot: for each its joint (0 for the base), both ends in the joint's axes,
    mm, and its radius, mm."""
    return {
        "name": robot.name,
        "capsules": [
            [each.joint, *(round(1e3 * x) for x in (*each.start, *each.end, each.radius))]
            for each in cover_of(robot).capsules
        ],
    }


def pose_of(t: float, poses: np.ndarray) -> Shape:
    """Returns the simulated time, s, and the poses (J, 7) of joints and tip: position, mm, and quaternion
    wxyz."""
    return {
        "t": round(t, 2),
        "joints": [
            [*(round(1e3 * float(x)) for x in each[:3]), *(round(float(x), 3) for x in each[3:])]
            for each in poses
        ],
    }

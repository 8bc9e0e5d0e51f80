"""A velocity-level scene: robot, settings, mission and start, as data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lessons.settings.velocity import MobileSettings
from lessons.velocity_events import MobileEvent
from robots import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MobileScene:
    """Everything a velocity-level run starts from.

    Attributes:
        name: identity.
        title: one line for lists and the page.
        robot: the robot.
        settings: controller, limits, plant, the levels by role, and the options that make the mission.
        q_0: initial positions, (n,) rad or m; the robot starts at rest.
        duration: longest headless run, s; it ends earlier when the mission is done.
        events: (time in s, event) in order, for scripted scenes.
    """

    name: str
    title: str
    robot: Robot
    settings: MobileSettings
    q_0: Array
    duration: float = 16.0
    events: tuple[tuple[float, MobileEvent], ...] = ()

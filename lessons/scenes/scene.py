"""The start of a run as data: the fields that both kinds of scenes share."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lessons.events import Event
from lessons.settings.settings import SceneSettings
from robots import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene(ABC):
    """Everything a run starts from.

    Attributes:
        name: unique name.
        title: one line for lists and the page.
        robot: the robot.
        settings: controller, limits, plant and levels at the start; their class is the scene's kind.
        q_0: initial positions, (n,) rad or m.
        duration: default length of a headless run, s; a run with a mission ends earlier if the mission is
            completed.
        events: (time in s, event) in order, for scripted scenes.
    """

    name: str
    title: str
    robot: Robot
    settings: SceneSettings
    q_0: Array
    duration: float = 4.0
    events: tuple[tuple[float, Event], ...] = ()

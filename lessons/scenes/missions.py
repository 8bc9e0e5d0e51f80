"""The velocity-level scenes: the mobile manipulator's missions, and two arms."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from himpc.htmpc import HTMPCSettings
from himpc.stack import Level
from himpc.tasks import FrameOrientation, FramePosition
from lessons.events import Event, MoveTarget, Release
from lessons.scenes.names import VELOCITY_SCENES
from lessons.scenes.scene import VelocityScene
from lessons.settings.missions import (
    BESIDE_THE_WAY,
    CLUTTER,
    ClutteredOptions,
    DeliveryOptions,
    MissionOptions,
    PerceptionOptions,
    SquareOptions,
    Stay,
    WaypointOptions,
)
from lessons.settings.velocity import STAGE_WEIGHT, VelocitySettings
from robots import load_robot
from robots.collision import Obstacle

DELIVERY_SPEEDS = (0.5, 0.5, 1.0, 0.5, 1.0, 1.0, 2.0, 2.0, 2.0)
"""Speed limits of a robot that works among people, m/s and rad/s."""


class _Mission(NamedTuple):
    """A mission of the mobile manipulator: its options, duration (s), obstacles and events, and whether the
    robot works among people."""

    options: MissionOptions
    duration: float
    obstacles: tuple[Obstacle, ...] = ()
    among_people: bool = False
    events: tuple[tuple[float, Event], ...] = ()


_HANDOVER = (
    (8.0, MoveTarget("base 2", (-1.2, -0.4))),
    (8.0, MoveTarget("ee 2", (-1.9, -0.7, 0.8))),
    (14.0, Release("ee 1")),
    (17.5, MoveTarget("ee 2", (-1.9, -0.4, 1.0))),
    (24.0, Release("ee 2")),
)
"""The hand holds every ball until it is taken, the first ball until 14 s. Meanwhile the second person moves,
and later also moves the hand that receives the ball."""
_MISSIONS = {
    "ridgeback-ur10-drag": _Mission(Stay(), 8.0),
    "ridgeback-ur10-square": _Mission(SquareOptions(), 16.0),
    "ridgeback-ur10-waypoints": _Mission(WaypointOptions(), 60.0),
    "ridgeback-ur10-delivery": _Mission(DeliveryOptions(), 400.0, among_people=True),
    "ridgeback-ur10-handover": _Mission(
        DeliveryOptions(seats=(1, 3), rounds=1, hold_s=None), 60.0, among_people=True, events=_HANDOVER
    ),
    "ridgeback-ur10-cluttered": _Mission(ClutteredOptions(), 30.0, CLUTTER),
    "ridgeback-ur10-perception": _Mission(PerceptionOptions(), 16.0, BESIDE_THE_WAY),
}
_ARMS = {"iiwa14-htmpc": "iiwa14", "panda-htmpc": "panda"}


def velocity_scene(name: str) -> VelocityScene:
    """Returns a scene of VELOCITY_SCENES."""
    if name in _ARMS:
        robot, mission = load_robot(_ARMS[name]), _Mission(Stay(), 4.0)
        tasks = FramePosition(name="position"), FrameOrientation(name="orientation")
    else:
        robot, mission = load_robot("ridgeback-ur10"), _MISSIONS[name]
        tasks = FramePosition(name="ee"), FramePosition(name="base", frame="base", axes="xy")
    if mission.among_people:
        robot = replace(robot, v_limit=np.array(DELIVERY_SPEEDS))
    levels = tuple(Level((task,), Q=STAGE_WEIGHT["proximal"]) for task in tasks)
    return VelocityScene(
        name=name,
        title=VELOCITY_SCENES[name],
        robot=robot,
        settings=VelocitySettings(
            HTMPCSettings(levels, obstacles=mission.obstacles), options=mission.options
        ),
        q_0=robot.home,
        duration=mission.duration,
        events=mission.events,
    )

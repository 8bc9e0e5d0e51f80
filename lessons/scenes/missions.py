"""The velocity-level scenes: the mobile manipulator's missions, and two arms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

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
from robots import Robot, load_robot
from robots.collision import Obstacle

DELIVERY_SPEEDS = (0.5, 0.5, 1.0, 0.5, 1.0, 1.0, 2.0, 2.0, 2.0)
"""Speed limits of a robot that works among people, m/s and rad/s."""


def velocity_scene(name: str) -> VelocityScene:
    """Returns a scene of VELOCITY_SCENES."""
    return _MAKERS[name]()


def _ridgeback(
    name: str, options: MissionOptions, duration: float, events: tuple[tuple[float, Event], ...] = ()
) -> VelocityScene:
    levels = (
        Level((FramePosition(name="ee"),), Q=STAGE_WEIGHT["proximal"]),
        Level((FramePosition(name="base", frame="base", axes="xy"),), Q=STAGE_WEIGHT["proximal"]),
    )
    return _scene(name, load_robot("ridgeback-ur10"), levels, options, duration, events)


def _scene(
    name: str,
    robot: Robot,
    levels: tuple[Level, ...],
    options: MissionOptions,
    duration: float,
    events: tuple[tuple[float, Event], ...] = (),
) -> VelocityScene:
    return VelocityScene(
        name=name,
        title=VELOCITY_SCENES[name],
        robot=robot,
        settings=VelocitySettings(HTMPCSettings(levels), options=options),
        q_0=robot.home,
        duration=duration,
        events=events,
    )


def _among_people(scene: VelocityScene) -> VelocityScene:
    return replace(scene, robot=replace(scene.robot, v_limit=np.array(DELIVERY_SPEEDS)))


def _handover() -> VelocityScene:
    """Returns the scene in which the hand holds every ball until it is taken, the first ball until 14 s.
    Meanwhile the second person moves, and later also moves the hand that receives the ball."""
    events = (
        (8.0, MoveTarget("base 2", (-1.2, -0.4))),
        (8.0, MoveTarget("ee 2", (-1.9, -0.7, 0.8))),
        (14.0, Release("ee 1")),
        (17.5, MoveTarget("ee 2", (-1.9, -0.4, 1.0))),
        (24.0, Release("ee 2")),
    )
    options = DeliveryOptions(seats=(1, 3), rounds=1, hold_s=None)
    return _among_people(_ridgeback("ridgeback-ur10-handover", options, 60.0, events))


def _among(scene: VelocityScene, obstacles: tuple[Obstacle, ...]) -> VelocityScene:
    htmpc = replace(scene.settings.htmpc, obstacles=obstacles)
    return replace(scene, settings=replace(scene.settings, htmpc=htmpc))


def _arm(robot: str) -> VelocityScene:
    levels = (
        Level((FramePosition(name="position"),), Q=STAGE_WEIGHT["proximal"]),
        Level((FrameOrientation(name="orientation"),), Q=STAGE_WEIGHT["proximal"]),
    )
    return _scene(f"{robot}-htmpc", load_robot(robot), levels, Stay(), 4.0)


_MAKERS: dict[str, Callable[[], VelocityScene]] = {
    "ridgeback-ur10-drag": lambda: _ridgeback("ridgeback-ur10-drag", Stay(), 8.0),
    "ridgeback-ur10-square": lambda: _ridgeback("ridgeback-ur10-square", SquareOptions(), 16.0),
    "ridgeback-ur10-waypoints": lambda: _ridgeback("ridgeback-ur10-waypoints", WaypointOptions(), 60.0),
    "ridgeback-ur10-delivery": lambda: _among_people(
        _ridgeback("ridgeback-ur10-delivery", DeliveryOptions(), 400.0)
    ),
    "ridgeback-ur10-handover": _handover,
    "ridgeback-ur10-cluttered": lambda: _among(
        _ridgeback("ridgeback-ur10-cluttered", ClutteredOptions(), 30.0), CLUTTER
    ),
    "ridgeback-ur10-perception": lambda: _among(
        _ridgeback("ridgeback-ur10-perception", PerceptionOptions(), 16.0), BESIDE_THE_WAY
    ),
    "iiwa14-htmpc": lambda: _arm("iiwa14"),
    "panda-htmpc": lambda: _arm("panda"),
}

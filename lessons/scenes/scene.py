"""The start of a run as data, at torque level and at velocity level."""

from __future__ import annotations

from abc import ABC
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import final

from himpc.references import Reference
from himpc.stack import Stack
from lessons.events import Event
from lessons.settings.settings import SceneSettings
from lessons.settings.torque import TorqueSettings
from lessons.settings.velocity import VelocitySettings
from robots import Robot
from robots.arrays import Array
from robots.world import World


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


References = Callable[[Robot, Stack], Mapping[str, Reference]]


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class TorqueScene(Scene):
    """A scene whose robot takes torques.

    Attributes:
        references: function that returns new references for a run, by task name. A task without a reference
            gets a draggable target at its initial value. If the settings have options, the options supply
            this function.
        v_0: initial velocities, (n,) rad/s.
        tau_0: torque that acts at the start, (n,) N·m; None: the torque that holds the plant at rest.
        world: the objects around the robot, which it touches if `plant.contacts` is true.
    """

    settings: TorqueSettings
    references: References
    v_0: Array
    tau_0: Array | None = None
    world: World = ()

    def __post_init__(self) -> None:
        if self.settings.options is not None:
            object.__setattr__(self, "references", self.settings.options.references)


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class VelocityScene(Scene):
    """A scene whose robot takes velocities. The robot starts at rest, and the options of the settings create
    the mission."""

    settings: VelocitySettings
    duration: float = 16.0

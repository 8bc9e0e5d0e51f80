"""A scene: robot, stack, references, plant and start, as data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from himpc.references import Reference
from himpc.stack import Stack
from lessons.events import Event
from lessons.settings.torque import SceneSettings
from robots import Robot

Array = NDArray[np.float64]
References = Callable[[Robot, Stack], Mapping[str, Reference]]


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a run starts from.

    Attributes:
        name: identity.
        title: one line for lists and the page.
        robot: the robot.
        settings: controller, limits, plant and stack at the start.
        references: makes a fresh reference per task name for each run; tasks without one get a
            draggable target that starts where the task's value is at the start. A scene whose settings
            have options takes it from them.
        q_0: initial positions, (n,) rad.
        v_0: initial velocities, (n,) rad/s.
        tau_0: torque acting at the start, (n,) N·m; None: the plant's holding torque.
        duration: default length of a headless run, s.
        events: (time in s, event) in order, for scripted scenes.
        sources: catalog name or URDF path and tip, so that a child process can load the same scene.
    """

    name: str
    title: str
    robot: Robot
    settings: SceneSettings
    references: References
    q_0: Array
    v_0: Array
    tau_0: Array | None = None
    duration: float = 4.0
    events: tuple[tuple[float, Event], ...] = ()
    sources: Mapping[str, str | None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.settings.options is not None:
            object.__setattr__(self, "references", self.settings.options.references)

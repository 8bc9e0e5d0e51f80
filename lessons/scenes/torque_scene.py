"""A torque-level scene: robot, stack, references, plant and start, as data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from himpc.references import Reference
from himpc.stack import Stack
from lessons.scenes.scene import Scene
from lessons.settings.torque import TorqueSettings
from robots import Robot
from robots.world import World

Array = NDArray[np.float64]
References = Callable[[Robot, Stack], Mapping[str, Reference]]


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class TorqueScene(Scene):
    """A scene whose robot takes torques.

    Attributes:
        references: makes a fresh reference per task name for each run; tasks without one get a draggable
            target that starts where the task's value is at the start. A scene whose settings have options
            takes it from them.
        v_0: initial velocities, (n,) rad/s.
        tau_0: torque acting at the start, (n,) N·m; None: the plant's holding torque.
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

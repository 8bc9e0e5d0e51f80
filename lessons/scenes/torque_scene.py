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

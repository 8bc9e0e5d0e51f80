"""A task for the position of a frame's origin in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

from himpc.tasks.axes import FrameTask
from robots.arrays import Array

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration


@dataclass(frozen=True, kw_only=True)
class FramePosition(FrameTask):
    """x = position of the frame's origin along the chosen world axes, in metres (level 1 of Table IV)."""

    first_row: ClassVar[int] = 0
    unit: ClassVar[Literal["m", "rad"]] = "m"

    def value(self, configuration: Configuration) -> Array:
        return configuration.placement(self.frame).translation[self.components]

    def error(self, value: Array, desired: Array) -> Array:
        return value - desired

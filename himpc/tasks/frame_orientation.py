"""Orientation of a frame in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

from himpc.rotation import log3
from himpc.tasks.frame import FrameTask
from himpc.tasks.task import Array, Gain

if TYPE_CHECKING:
    from himpc.configuration import Configuration


@dataclass(frozen=True, kw_only=True)
class FrameOrientation(FrameTask):
    """x̃ = log₃(R R_dᵀ) in world axes, ẋ = ω (level 2 of Table IV).

    The value is the rotation matrix R (3, 3); the error is in radians along the chosen world axes.
    """

    K_p: Gain = 50.0
    K_v: Gain = 5.0

    first_row: ClassVar[int] = 3
    unit: ClassVar[Literal["m", "rad"]] = "rad"

    def value(self, configuration: Configuration) -> Array:
        return configuration.placement(self.frame).rotation

    def error(self, value: Array, desired: Array) -> Array:
        return log3(value @ desired.T)[self.components]

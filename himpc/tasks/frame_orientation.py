"""A task for the orientation of a frame in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

from himpc.tasks.axes import FrameTask
from himpc.tasks.orientation import OrientationTask
from robots.arrays import Array

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration


@dataclass(frozen=True, kw_only=True)
class FrameOrientation(OrientationTask, FrameTask):
    """x̃ = log₃(R R_dᵀ) in world axes, ẋ = ω (level 2 of Table IV); on fewer axes see `OrientationTask`."""

    first_row: ClassVar[int] = 3
    unit: ClassVar[Literal["m", "rad"]] = "rad"

    def value(self, configuration: Configuration) -> Array:
        return configuration.placement(self.frame).rotation

    def rotations(self, configuration: Configuration) -> list[Array]:
        return [placement.rotation for placement in configuration.placements(self.frame)]

    def angular_jacobian(self, configuration: Configuration) -> Array:
        return configuration.frame_jacobians(self.frame)[:, 3:]

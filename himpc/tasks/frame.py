"""The base class of position and orientation tasks of a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from himpc.tasks.axes import AXES, OnAxes
from himpc.tasks.task import Array

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration

__all__ = ["AXES", "FrameTask"]


@dataclass(frozen=True, kw_only=True)
class FrameTask(OnAxes):
    """A task for the position or the orientation of a frame, along some of the world axes.

    Attributes:
        frame: name of a frame of the robot; empty means the robot's tip.
        axes: world axes that are controlled, any non-empty subset of "xyz".
    """

    frame: str = ""

    first_row: ClassVar[int] = 0
    """Index of the task's first row in the 6 × n frame Jacobian (linear over angular, world axes)."""

    def jacobian(self, configuration: Configuration) -> Array:
        rows = slice(self.first_row, self.first_row + 3)
        return configuration.frame_jacobians(self.frame)[:, rows][:, self.components]

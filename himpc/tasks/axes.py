"""The base classes of position and orientation tasks with a choice of axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from himpc.references.preview import Preview
from himpc.tasks.task import Task
from robots import InputError
from robots.arrays import Array

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration
    from robots import Robot


AXES = "xyz"


@dataclass(frozen=True, kw_only=True)
class OnAxes(Task):
    """A task on some of three axes.

    Attributes:
        axes: controlled axes, any non-empty subset of "xyz".
    """

    axes: str = AXES

    def __post_init__(self) -> None:
        """Raises InputError unless `axes` is a non-empty subset of "xyz"."""
        if (
            not self.axes
            or any(axis not in AXES for axis in self.axes)
            or len(set(self.axes)) < len(self.axes)
        ):
            raise InputError(
                f"axes of task '{self.name}' are '{self.axes}': give some of x, y and z, once each"
            )

    @property
    def components(self) -> list[int] | slice:
        """Indices of the components that the task controls. If the task controls all three, this is a slice,
        which avoids a copy."""
        return slice(0, 3) if self.axes == AXES else [AXES.index(axis) for axis in self.axes]

    def coordinates(self, robot: Robot) -> tuple[str, ...]:
        return tuple(self.axes)

    def reference_in_task_coordinates(self, configuration: Configuration, preview: Preview) -> Preview:
        """Returns the components of a reference along the task's axes. Only a rotation has components along
        all three axes."""
        if preview.value.ndim == 1 or preview.velocity.shape[1] == len(self.axes):
            return preview
        on = self.components
        return Preview(
            preview.value, preview.displacement[:, on], preview.velocity[:, on], preview.acceleration[:, on]
        )


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

"""The choice of axes that tasks of points and rotations share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from himpc.references.preview import Preview
from himpc.tasks.task import Task
from robots import InputError

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration
    from robots import Robot

AXES = "xyz"


@dataclass(frozen=True, kw_only=True)
class OnAxes(Task):
    """A task on some of three axes.

    Attributes:
        axes: those that are controlled, any non-empty subset of "xyz".
    """

    axes: str = AXES

    def __post_init__(self) -> None:
        """Raises InputError for anything else."""
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
        """Which of the three components the task controls; a slice, which copies nothing, if it is all."""
        return slice(0, 3) if self.axes == AXES else [AXES.index(axis) for axis in self.axes]

    def coordinates(self, robot: Robot) -> tuple[str, ...]:
        return tuple(self.axes)

    def asked(self, configuration: Configuration, preview: Preview) -> Preview:
        """Of a rotation, which turns about all axes, the components on the task's own."""
        if preview.value.ndim == 1 or preview.velocity.shape[1] == len(self.axes):
            return preview
        on = self.components
        return Preview(
            preview.value, preview.displacement[:, on], preview.velocity[:, on], preview.acceleration[:, on]
        )

"""What position and orientation tasks of a frame share: the choice of world axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from himpc.tasks.task import Array, Task
from robots import InputError

if TYPE_CHECKING:
    from himpc.configuration import Configuration
    from robots import Robot

AXES = "xyz"


@dataclass(frozen=True, kw_only=True)
class FrameTask(Task):
    """A task on some of the world axes of a frame.

    Attributes:
        frame: name of a frame of the robot; empty means the robot's tip.
        axes: world axes that are controlled, any non-empty subset of "xyz".
    """

    frame: str = ""
    axes: str = AXES

    first_row: ClassVar[int] = 0
    """First row of the task's part of the 6 × n frame Jacobian (linear over angular, world axes)."""

    def __post_init__(self) -> None:
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

    def jacobian(self, configuration: Configuration) -> Array:
        rows = slice(self.first_row, self.first_row + 3)
        return configuration.frame_jacobians(self.frame)[:, rows][:, self.components]

"""What position and orientation tasks of a frame share: the choice of world axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from himpc.tasks.task import Array, Task

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

    @property
    def components(self) -> list[int]:
        return [AXES.index(axis) for axis in self.axes]

    def rows(self) -> list[int]:
        """Rows of the 6 × n frame Jacobian (linear over angular, world axes)."""
        raise NotImplementedError

    def coordinates(self, robot: Robot) -> tuple[str, ...]:
        return tuple(self.axes)

    def jacobian(self, configuration: Configuration) -> Array:
        return configuration.frame_jacobians(self.frame)[:, self.rows()]

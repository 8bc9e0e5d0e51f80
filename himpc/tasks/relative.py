"""Tasks for the pose of one frame relative to another, such as two hands that carry an object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

from himpc.tasks.axes import OnAxes
from himpc.tasks.orientation import OrientationTask
from robots.arrays import Array

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration


@dataclass(frozen=True, kw_only=True)
class RelativeTask(OnAxes):
    """A task on some axes of a root frame, which may move (Pink and Mink: RelativeFrameTask).

    Attributes:
        frame: name of the controlled frame; empty means the robot's tip.
        root: name of the frame in which the pose is expressed; empty means the robot's first frame, which is
            fixed.
        axes: axes of the root that are controlled, any non-empty subset of "xyz".
    """

    frame: str = ""
    root: str = ""

    first_row: ClassVar[int] = 0
    """Index of the task's first row in the 6 × n relative Jacobian (linear over angular, root's axes)."""

    def _frames(self, configuration: Configuration) -> tuple[str, str]:
        return self.frame or configuration.robot.tip, self.root or configuration.robot.frames[0]

    def jacobian(self, configuration: Configuration) -> Array:
        rows = slice(self.first_row, self.first_row + 3)
        return configuration.relative_jacobians(*self._frames(configuration))[:, rows][:, self.components]


@dataclass(frozen=True, kw_only=True)
class RelativePosition(RelativeTask):
    """x = R_rootᵀ (p − p_root) along the chosen axes of the root, m."""

    unit: ClassVar[Literal["m", "rad"]] = "m"

    def value(self, configuration: Configuration) -> Array:
        return configuration.relative_placement(*self._frames(configuration)).translation[self.components]

    def error(self, value: Array, desired: Array) -> Array:
        return value - desired


@dataclass(frozen=True, kw_only=True)
class RelativeOrientation(OrientationTask, RelativeTask):
    """x̃ = log₃(R R_dᵀ) with R = R_rootᵀ R_frame, in axes of the root; ẋ = R_rootᵀ (ω − ω_root). On fewer axes
    see `OrientationTask`.
    """

    first_row: ClassVar[int] = 3
    unit: ClassVar[Literal["m", "rad"]] = "rad"

    def value(self, configuration: Configuration) -> Array:
        return configuration.relative_placement(*self._frames(configuration)).rotation

    def rotations(self, configuration: Configuration) -> list[Array]:
        frame, root = self._frames(configuration)
        pairs = zip(configuration.placements(frame), configuration.placements(root), strict=True)
        return [sees.rotation.T @ seen.rotation for seen, sees in pairs]

    def angular_jacobian(self, configuration: Configuration) -> Array:
        return configuration.relative_jacobians(*self._frames(configuration))[:, 3:]

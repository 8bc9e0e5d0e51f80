"""One frame of the robot as another one sees it: two hands that carry something together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from himpc.rotation import log3
from himpc.tasks.axes import OnAxes
from himpc.tasks.task import Array, Gain

if TYPE_CHECKING:
    from himpc.configuration import Configuration
    from robots import Robot


@dataclass(frozen=True, kw_only=True)
class RelativeTask(OnAxes):
    """A task on some axes of a root frame, which moves itself (Pink and Mink: RelativeFrameTask).

    Attributes:
        frame: name of the frame that is seen; empty means the robot's tip.
        root: name of the frame that sees it; empty means the robot's first one, which stands still.
        axes: axes of the root that are controlled, any non-empty subset of "xyz".
    """

    frame: str = ""
    root: str = ""

    def _views(self, configuration: Configuration) -> tuple[Array, Array, Array, Array]:
        """R_root (N, 3, 3), p − p_root (N, 3) in world axes, and the frames' Jacobians, (N, 6, n) each."""
        root = self.root or configuration.robot.frames[0]
        seen, sees = configuration.frame_jacobians(self.frame), configuration.frame_jacobians(root)
        here, there = configuration.placements(root), configuration.placements(self.frame)
        turns = np.array([place.rotation for place in here])
        apart = np.array([far.translation - near.translation for far, near in zip(there, here, strict=True)])
        return turns, apart, seen, sees

    def names(self, robot: Robot) -> tuple[str, str]:
        """Both frames by their names."""
        return self.frame or robot.tip, self.root or robot.frames[0]


@dataclass(frozen=True, kw_only=True)
class RelativePosition(RelativeTask):
    """x = R_rootᵀ (p − p_root) along the chosen axes of the root, m.

    J = R_rootᵀ (J_p − J_p,root + [p − p_root]× J_ω,root).
    """

    unit: ClassVar[Literal["m", "rad"]] = "m"

    def value(self, configuration: Configuration) -> Array:
        root = configuration.placement(self.root or configuration.robot.frames[0])
        return (root.actInv(configuration.placement(self.frame).translation))[self.components]

    def error(self, value: Array, desired: Array) -> Array:
        return value - desired

    def jacobian(self, configuration: Configuration) -> Array:
        turns, apart, seen, sees = self._views(configuration)
        carried = np.cross(apart[:, None], sees[:, 3:].transpose(0, 2, 1)).transpose(0, 2, 1)
        moved = seen[:, :3] - sees[:, :3] + carried
        return (turns.transpose(0, 2, 1) @ moved)[:, self.components]


@dataclass(frozen=True, kw_only=True)
class RelativeOrientation(RelativeTask):
    """x̃ = log₃(R R_dᵀ) with R = R_rootᵀ R_frame, in axes of the root; ẋ = R_rootᵀ (ω − ω_root).

    The value is the rotation matrix R (3, 3); the error is in radians along the chosen axes.
    """

    K_p: Gain = 50.0
    K_v: Gain = 5.0

    unit: ClassVar[Literal["m", "rad"]] = "rad"

    def value(self, configuration: Configuration) -> Array:
        root = configuration.placement(self.root or configuration.robot.frames[0])
        return root.rotation.T @ configuration.placement(self.frame).rotation

    def error(self, value: Array, desired: Array) -> Array:
        return log3(value @ desired.T)[self.components]

    def jacobian(self, configuration: Configuration) -> Array:
        turns, _, seen, sees = self._views(configuration)
        return (turns.transpose(0, 2, 1) @ (seen[:, 3:] - sees[:, 3:]))[:, self.components]

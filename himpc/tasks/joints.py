"""Joint-space tasks: chosen joints, the whole posture, and pure damping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, final

import numpy as np

from himpc.tasks.task import Gain, Task
from robots.arrays import Array

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration
    from robots import Robot


@dataclass(frozen=True, kw_only=True)
class OnJoints(Task):
    """x = the positions of some joints. J is a constant selection matrix.

    Attributes:
        joints: joint names; empty means all of them (a posture task).
    """

    joints: tuple[str, ...] = ()
    K_p: Gain = 50.0
    K_v: Gain = 5.0

    unit: ClassVar[Literal["m", "rad"]] = "rad"

    def coordinates(self, robot: Robot) -> tuple[str, ...]:
        return self.joints or robot.joint_names

    def value(self, configuration: Configuration) -> Array:
        return configuration.q[configuration.joint_indices(self.joints)]

    def jacobian(self, configuration: Configuration) -> Array:
        return configuration.joint_jacobians(self.joints)


@final
@dataclass(frozen=True, kw_only=True)
class Joints(OnJoints):
    """Moves some joints to their desired values (level 3 of Table IV: q₁)."""

    def error(self, value: Array, desired: Array) -> Array:
        return value - desired


@final
@dataclass(frozen=True, kw_only=True)
class Posture(OnJoints):
    """Moves all joints to a desired posture."""

    def error(self, value: Array, desired: Array) -> Array:
        return value - desired


@final
@dataclass(frozen=True, kw_only=True)
class Damping(OnJoints):
    """Damps all joints, with K_p = 0: the residual of (4) is q̈ + K_v q̇. Motions that no other task controls
    come to rest.

    R in (31) weighs Δτ only. In a direction without a task the torque is constant, the motion is not damped,
    and after a push the robot accelerates for ever. This task, as the last level, damps such motions.
    """

    K_p: Gain = 0.0
    K_v: Gain = 5.0

    def error(self, value: Array, desired: Array) -> Array:
        return np.zeros_like(value)

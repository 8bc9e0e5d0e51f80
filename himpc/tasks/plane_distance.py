"""A task for the distance of a frame from a plane, such as a table or a wall."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from himpc.tasks.task import Task
from robots import InputError
from robots.arrays import Array

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration
    from robots import Robot


@dataclass(frozen=True, kw_only=True)
class PlaneDistance(Task):
    """x = nᵀp − d, m: the signed distance of a frame's origin from the plane nᵀx = d.

    Attributes:
        frame: name of a frame of the robot; empty means the robot's tip.
        normal: direction of n in the world; its length may be any number except zero.
        offset: d, the distance of the plane from the world's origin along n, m.
    """

    frame: str = ""
    normal: tuple[float, ...] = (0.0, 0.0, 1.0)
    offset: float = 0.0

    unit: ClassVar[Literal["m", "rad"]] = "m"

    def __post_init__(self) -> None:
        """Raises InputError for a normal that has no direction, or an offset that is not finite."""
        if len(self.normal) != 3 or not 0.0 < float(np.linalg.norm(self.normal)) < np.inf:
            raise InputError(
                f"normal of task '{self.name}' is {list(self.normal)}: give three finite numbers, "
                "not all of them zero, e.g. [0, 0, 1]"
            )
        if not np.isfinite(self.offset):
            raise InputError(f"offset of task '{self.name}' is {self.offset}: give a finite number, in m")

    @property
    def n(self) -> Array:
        """Unit normal, (3,)."""
        normal = np.array(self.normal)
        return normal / np.linalg.norm(normal)

    def coordinates(self, robot: Robot) -> tuple[str, ...]:
        return ("distance",)

    def value(self, configuration: Configuration) -> Array:
        return np.array([self.n @ configuration.placement(self.frame).translation - self.offset])

    def error(self, value: Array, desired: Array) -> Array:
        return value - desired

    def jacobian(self, configuration: Configuration) -> Array:
        return self.n @ configuration.frame_jacobians(self.frame)[:, None, :3]

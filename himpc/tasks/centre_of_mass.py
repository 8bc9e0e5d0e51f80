"""The centre of mass of the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

from himpc.tasks.axes import AXES, OnAxes
from robots.arrays import Array

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration


@dataclass(frozen=True, kw_only=True)
class CentreOfMass(OnAxes):
    """x = centre of mass of all moving links, along the chosen world axes, m (Pink and Mink: ComTask).

    Links that are fixed to the world do not count, such as Baxter's torso and head of 36.3 kg. With a fixed
    mass m_fixed and a moving mass m, the centre of all masses moves m/(m + m_fixed) times as far as the
    centre of the moving mass. No other task uses masses. The masses are those of the robot's description and
    do not include a payload.

    Attributes:
        axes: world axes that are controlled, any non-empty subset of "xyz".
    """

    axes: str = AXES

    unit: ClassVar[Literal["m", "rad"]] = "m"

    def value(self, configuration: Configuration) -> Array:
        return configuration.centre_of_mass()[self.components]

    def error(self, value: Array, desired: Array) -> Array:
        return value - desired

    def jacobian(self, configuration: Configuration) -> Array:
        return configuration.centre_of_mass_jacobians()[:, self.components]

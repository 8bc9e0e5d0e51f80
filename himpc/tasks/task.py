"""A task: coordinates x_i = f_i(q) with the gains of the target motion dynamics (4)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np

from robots.arrays import Array
from robots.ranges import Range, Shown

if TYPE_CHECKING:
    from himpc.kinematics.configuration import Configuration
    from himpc.references import Preview
    from robots import Robot

GAINS = Range(0.0, 1e8)
"""At the shortest control period, 0.1 ms, an error times this K_p crosses zero within one period."""
Gain = Annotated[float | tuple[float, ...], GAINS]


@dataclass(frozen=True, kw_only=True)
class Task(ABC):
    """A task of a hierarchy level: its coordinates, Jacobian and gains.

    The desired closed loop is (4) of the HIMPC paper: x̃'' + K_v x̃' + K_p x̃ = 0 with x̃ = x − x_d.

    Attributes:
        name: the unique name of the task, which events, telemetry and references refer to.
        K_p: stiffness, 1/s² (scalar or one per coordinate).
        K_v: damping, 1/s (scalar or one per coordinate).
    """

    name: str
    K_p: Annotated[Gain, Shown("K_P", "Stiffness", "1/s²", 0.0, 1000.0, 1.0, name="K_P of *")] = 200.0
    K_v: Annotated[Gain, Shown("K_V", "Damping", "1/s", 0.0, 100.0, 0.5, name="K_V of *")] = 10.0

    unit: ClassVar[Literal["m", "rad"]] = "m"

    @abstractmethod
    def coordinates(self, robot: Robot) -> tuple[str, ...]:
        """Returns the names of the m coordinates, in the order of the error's components."""

    @abstractmethod
    def value(self, configuration: Configuration) -> Array:
        """Returns x_i of (2) at the measured state: (m,) coordinates, or a rotation matrix (3, 3)."""

    @abstractmethod
    def error(self, value: Array, desired: Array) -> Array:
        """Returns x̃ = x − x_d, shape (m,), in the task's unit."""

    @abstractmethod
    def jacobian(self, configuration: Configuration) -> Array:
        """Returns J_i of (3) at every knot, shape (N, m, n); knot 0 is the measured state."""

    def target(self, configuration: Configuration) -> Array:
        """Returns the x_d for which the present error is zero. A draggable target starts at this value."""
        return self.value(configuration)

    def reference_in_task_coordinates(self, configuration: Configuration, preview: Preview) -> Preview:
        """Returns the reference in the task's coordinates. It differs from `preview` only if the target has
        other coordinates."""
        return preview

    def gains(self, m: int) -> tuple[Array, Array]:
        """Returns K_p and K_v as (m,) arrays."""
        return np.broadcast_to(np.asarray(self.K_p, float), (m,)), np.broadcast_to(
            np.asarray(self.K_v, float), (m,)
        )

"""The base class of all torque-level controllers."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from himpc.formulation.settings import Settings
from himpc.limits import Limits, in_force
from robots import Robot

Array = NDArray[np.float64]


class TorqueController(ABC):
    """Holds the robot, the settings in use, the acting torque and the bounds in force. After a reset the
    bounds are infinite at first and shrink gradually to the set limits."""

    def __init__(self, robot: Robot, settings: Settings) -> None:
        """Raises InputError if the settings name frames or joints that the robot does not have."""
        self.robot = robot
        self._data = robot.model.createData()
        self._settings = settings
        self._apply(settings)
        self.reset(np.zeros(robot.n))

    @property
    def settings(self) -> Settings:
        """The settings in use."""
        return self._settings

    def reset(self, tau_0: Array) -> None:
        """Clears all memory; τ₀ (n,) N·m is the torque acting now."""
        self._tau_0 = np.array(tau_0, float)
        self._limits = in_force(self.robot, Limits(torque=False, velocity=False, position="off"))

    @abstractmethod
    def _apply(self, settings: Settings) -> None:
        """Applies new settings. Raises InputError before it changes anything."""

"""The simulated robot beside the arm. It has the same controller and gets the same orders."""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from app.arm.loop import accepted
from app.arm.orders import Order
from himpc.export.kernel.adjust import LIMITS, TARGET
from himpc.export.native import NativeController
from robots.arms.arm import ArmLimits
from robots.arms.simulated_arm import SimulatedArm
from robots.plant import Plant

Array = NDArray[np.float64]


@final
class Model:
    """Simulates up to the arm's clock, including periods that the arm missed.

    Attributes:
        q, tau: state and torque of the simulated robot, (n,) rad and N·m (without gravity).
        x_d, R_d: the filtered targets, per row (m, rad) and per task (rotations).
    """

    def __init__(self, plant: Plant, controller: NativeController, limits: ArmLimits, period: float) -> None:
        """plant: the simulated robot, in the pose of the arm; controller: an independent controller; limits:
        the limits of the arm's loop; period: the control period, s."""
        self._arm = SimulatedArm(plant, period, in_step=False)
        self._controller, self._limits, self._period = controller, limits, period
        controller.set(LIMITS, 0, [*limits.tau, *limits.v, *limits.q_lower, *limits.q_upper])
        controller.reset()
        self.q, self.tau = plant.q, np.zeros(controller.n)
        self.x_d, self.R_d = controller.view("x_d"), controller.view("R_d")
        self._periods = 0

    def take(self, order: Order) -> None:
        """Drags a target before the next period."""
        self._controller.set(TARGET, order.task, order.values)

    def follow(self, t: float) -> None:
        """Simulates until t (s after the start)."""
        while (self._periods - 0.5) * self._period < t:
            reading = self._arm.read()
            self.q = reading.q
            wanted, _ = self._controller.tick(reading.q, reading.v, reading.tau)
            self.tau = accepted(wanted, reading.tau, self._limits, self._period)
            self._arm.write(self.tau)
            self._periods += 1

"""A simulated arm with the interface of a real arm."""

from __future__ import annotations

import time
from typing import final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robots.arms.arm import Arm, ArmLimits, ArmLost, Reading
from robots.plant import Plant

Array = NDArray[np.float64]

TAU_RATE = 1000.0
"""Largest rate of change of a torque, N·m/s."""


@final
class SimulatedArm(Arm):
    """A robot in MuJoCo that compensates the gravity of its description. A payload that the description lacks
    pulls the robot down, as with a real arm. With `in_step` the robot also moves if no torque arrives: if the
    caller is late, the last torque acts for several periods.
    """

    def __init__(self, plant: Plant, period: float = 1e-3, in_step: bool = True) -> None:
        """plant: the simulated robot at its initial state; period: control period, s; in_step: whether
        simulated time follows real time; otherwise simulated time advances by one period per read."""
        robot = plant.robot
        rate = np.full(robot.n, TAU_RATE)
        self.limits = ArmLimits(
            robot.tau_limit, rate, robot.v_limit, np.array(robot.q_lower), np.array(robot.q_upper)
        )
        self.plant = plant
        self._period, self._in_step = period, in_step
        self._data = robot.model.createData()
        self._tau = self._acted = np.zeros(robot.n)
        self._due: float | None = None
        self._stopped = False

    def read(self) -> Reading:
        self._check()
        for _ in range(self._passed()):
            gravity = self._gravity()
            self._acted = self.plant.step(self._tau + gravity, self._period) - gravity
        state = self.plant.measure(self._period)
        return Reading(state.q, state.v, self._acted, state.t)

    def write(self, tau: Array) -> None:
        self._check()
        self._tau = np.clip(tau, -self.limits.tau, self.limits.tau)

    def stop(self) -> None:
        self._stopped = True

    def _check(self) -> None:
        if self._stopped:
            raise ArmLost("the simulated arm was stopped")

    def _passed(self) -> int:
        """Waits for the next period; returns the number of periods since the last read."""
        now = time.monotonic()
        if self._due is None:
            self._due = now + self._period
            return 0
        if not self._in_step:
            return 1
        time.sleep(max(0.0, self._due - now))
        passed = 1 + max(0, int((now - self._due) / self._period))
        self._due += passed * self._period
        return passed

    def _gravity(self) -> Array:
        """g(q) of the description, (n,) N·m."""
        return pin.computeGeneralizedGravity(self.plant.robot.model, self._data, self.plant.q)

"""Two simulated arms: one in the place of a real arm, and the model beside an arm."""

from __future__ import annotations

import contextlib
import os
import signal
import time

import numpy as np
import pinocchio as pin

from examples.franka.guard import Array, Limits, Reading
from examples.franka.loop import Plan, Shared
from himpc.export.native import NativeController
from robots import Plant

LOOK = 0.02  # s between two looks at the loop's rows


class SimulatedArm:
    """An arm in MuJoCo. In real time the last torque acts for several periods if the caller is late."""

    def __init__(self, plant: Plant, period: float, real_time: bool = False) -> None:
        robot, self.plant, self._period = plant.robot, plant, period
        self._due = time.monotonic() + period if real_time else None
        self._data, self._tau, self._acted = robot.model.createData(), np.zeros(robot.n), np.zeros(robot.n)
        rate, v = np.full(robot.n, 1000.0), robot.v_limit
        self.limits = Limits(robot.tau_limit, rate, v, robot.q_lower, robot.q_upper)

    def read(self) -> Reading:
        passed = 1
        if self._due is not None:
            late = time.monotonic() - self._due
            time.sleep(max(0.0, -late))
            passed += max(0, int(late / self._period))
            self._due += passed * self._period
        for _ in range(passed):
            gravity = pin.computeGeneralizedGravity(self.plant.robot.model, self._data, self.plant.q)
            self._acted = self.plant.step(self._tau + gravity, self._period) - gravity
        state = self.plant.measure(self._period)
        return Reading(state.q, state.v, self._acted, state.t)

    def write(self, tau: Array) -> None:
        self._tau = np.clip(tau, -self.limits.tau, self.limits.tau)

    def stop(self) -> None:
        """A real arm holds its position by itself from here on."""


class Model:
    """The simulated robot beside the arm: the same controller, and the same drags at the same times."""

    def __init__(self, plant: Plant, controller: NativeController, plan: Plan) -> None:
        self._arm, self._controller, self._plan = SimulatedArm(plant, plan.period), controller, plan
        self._q, self._t = plant.q, -plan.period
        plan.begin(controller, np.zeros(controller.n))

    def at(self, t: float) -> Array:
        """Simulates until t, s after the start; returns the joints, (n,) rad."""
        plan = self._plan
        while self._t < t - 0.5 * plan.period:
            since, self._t = self._t, self._t + plan.period
            reading = self._arm.read()
            plan.drag(self._controller, since, self._t)
            wanted, _ = self._controller.tick(reading.q, reading.v, reading.tau)
            self._arm.write(plan.limits.accepted(wanted, reading.tau, plan.period))
            self._q = reading.q
        return self._q


def watch(model: Model, shared: Shared) -> None:
    """Simulates the model at each row of the loop, and reports how far it is from the arm, until the loop's
    process ends. The row before the newest one is certainly complete."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    hurry(10)  # below the loop
    done, loop = 0, os.getppid()
    while os.getppid() == loop:
        for k in range(done, max(0, int(shared.count[0]) - 1)):
            row, done = shared.rows[k], k + 1
            shared.q_model[k] = model.at(row["t"])
            shared.away[:] = np.abs(row["q"] - shared.q_model[k])
            shared.watched[0] = row["t"]
        time.sleep(LOOK)


def hurry(priority: int) -> None:
    """Requests real-time scheduling for this process, if the system allows it."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))

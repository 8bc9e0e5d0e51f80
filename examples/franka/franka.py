"""The door to a Franka arm: no other file imports pylibfranka."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any

import numpy as np
import pinocchio as pin

from examples.franka.guard import Array, Limits, Reading
from robots import InputError, Robot

LIMITS = Limits(  # Franka's documentation, "Robot limits": the narrower ranges and speeds of Panda and FR3
    np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0]),
    np.full(7, 990.0),  # the arm stops itself above 1000
    np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61]),
    np.array([-2.7437, -1.7628, -2.8973, -3.0421, -2.8065, 0.5445, -2.8973]),
    np.array([2.7437, 1.7628, 2.8973, -0.1518, 2.8065, 3.7525, 2.8973]),
)


class ArmLost(InputError):
    """The arm does not answer, or has stopped by itself; with its own message."""


class Franka:
    """A Franka arm, which adds the torques for gravity and for its configured load. `Reading.tau` is its
    `tau_J_d`, the last commanded torque; the measured `tau_J` contains gravity."""

    def __init__(self, address: str) -> None:
        """Connects; the arm does not move before the first `read`. Raises InputError."""
        self._control, self._finished = None, False
        try:
            self._library: Any = import_module("pylibfranka")
        except ImportError as error:
            raise InputError(f'pylibfranka is missing ({error}): pip install "himpc-lab[franka]"') from None
        with self._calls(f"{address}: "):
            self._robot = self._library.Robot(address, self._library.RealtimeConfig.kIgnore)

    def at_rest(self, robot: Robot) -> Array:
        """Returns the joint positions, (7,) rad, without taking control. Raises ArmLost, and InputError if a
        described robot has its last joint elsewhere than this arm at these positions."""
        with self._calls():
            state = self._robot.read_once()
        q, data = np.array(state.q), robot.model.createData()
        if robot.n == 7:
            pin.forwardKinematics(robot.model, data, q)
        end, hand = (np.reshape(each, (4, 4), order="F") for each in (state.O_T_EE, state.F_T_EE))
        last = data.oMi[robot.n]
        x, y, z = last.rotation.T @ ((end @ np.linalg.inv(hand))[:3, 3] - last.translation)
        # Franka's flange is on the axis of the last joint, at 0.107 m along it.
        if robot.n != 7 or not (max(abs(x), abs(y)) < 0.01 and -0.01 < z < 0.2):
            raise InputError(f"the scene's robot '{robot.name}' is not this arm: choose panda-hold")
        return q

    def read(self) -> Reading:
        with self._calls():
            self._control = self._control or self._robot.start_torque_control()
            state, _ = self._control.readOnce()
        return Reading(np.array(state.q), np.array(state.dq), np.array(state.tau_J_d), state.time.to_sec())

    def write(self, tau: Array, last: bool = False) -> None:
        torques = self._library.Torques(tau.tolist())
        torques.motion_finished = last
        with self._calls():
            self._control.writeOnce(torques)  # type: ignore[union-attr]

    def stop(self) -> None:
        if self._control is not None and not self._finished:
            with suppress(ArmLost):
                self.write(np.zeros(7), True)
            self._finished = True

    @contextmanager
    def _calls(self, where: str = "") -> Iterator[None]:
        try:
            yield
        except (RuntimeError, self._library.FrankaException) as error:
            self._finished = True
            raise ArmLost(where + " ".join(str(error).split()).removeprefix("libfranka: ")) from None

"""A Franka arm. No other module imports pylibfranka."""

from __future__ import annotations

from importlib import import_module
from typing import Any, final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robots.arms.arm import Arm, ArmLimits, ArmLost, Reading
from robots.errors import InputError
from robots.robot import Robot

Array = NDArray[np.float64]

# Given by Franka's documentation of its control interface ("Robot limits"). Ranges and speeds are the
# narrower ones of Panda and FR3.
_TAU = (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)  # N·m
_TAU_RATE = 990.0  # N·m/s; the arm stops itself above 1000
_V = (2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61)  # rad/s
_Q_LOWER = (-2.7437, -1.7628, -2.8973, -3.0421, -2.8065, 0.5445, -2.8973)  # rad
_Q_UPPER = (2.7437, 1.7628, 2.8973, -0.1518, 2.8065, 3.7525, 2.8973)  # rad
_ASIDE, _FARTHEST = 0.01, 0.2
"""m: the scene's robot is not this arm if the flange is farther than this from the axis of the last joint
(first value), or farther along this axis (second value). On a Franka arm the flange is on the axis, at 0.107
m along it (given by Franka's documentation)."""


@final
class Franka(Arm):
    """A Franka arm under torque control. The arm adds the torques for gravity and for its configured load.
    `Reading.tau` is the arm's `tau_J_d`, the last commanded torque without gravity."""

    def __init__(self, address: str, real_time: bool = False) -> None:
        """Connects; the arm does not move before the first `read`.

        Args:
            address: host name or IP address.
            real_time: whether libfranka refuses a kernel without real-time scheduling.

        Raises InputError if pylibfranka is missing or no arm answers.
        """
        self.limits = ArmLimits(
            np.array(_TAU), np.full(7, _TAU_RATE), np.array(_V), np.array(_Q_LOWER), np.array(_Q_UPPER)
        )
        self._library = _library()
        config = self._library.RealtimeConfig
        try:
            self._robot = self._library.Robot(address, config.kEnforce if real_time else config.kIgnore)
        except (RuntimeError, self._library.FrankaException) as error:
            raise InputError(f"--robot {address}: {_told(error)}; check the address of the arm") from None
        self._control: Any = None
        self._finished = False

    def at_rest(self, robot: Robot) -> Array:
        """Returns the joint positions, (7,) rad, without taking control. Raises ArmLost. Raises InputError if
        the description of a robot has its last joint at another position than this arm, for the same joint
        positions."""
        try:
            state = self._robot.read_once()
        except (RuntimeError, self._library.FrankaException) as error:
            raise ArmLost(_told(error)) from None
        q = np.array(state.q)
        base_to_end, flange_to_end = (
            np.reshape(each, (4, 4), order="F") for each in (state.O_T_EE, state.F_T_EE)
        )
        flange = (base_to_end @ np.linalg.inv(flange_to_end))[:3, 3]
        if robot.n == len(q):
            data = robot.model.createData()
            pin.forwardKinematics(robot.model, data, q)
            last = data.oMi[robot.n]
            x, y, z = last.rotation.T @ (flange - last.translation)
            if not (max(abs(x), abs(y)) < _ASIDE and -_ASIDE < z < _FARTHEST):
                raise InputError(
                    f"the scene's robot '{robot.name}' is not this arm: at the arm's joint positions the "
                    "flange would be elsewhere; choose a scene of your arm, such as panda-hold"
                )
        return q

    def read(self) -> Reading:
        try:
            if self._control is None:
                self._control = self._robot.start_torque_control()
            state, _ = self._control.readOnce()
        except (RuntimeError, self._library.FrankaException) as error:
            self._finished = True
            raise ArmLost(_told(error)) from None
        return Reading(np.array(state.q), np.array(state.dq), np.array(state.tau_J_d), state.time.to_sec())

    def write(self, tau: Array) -> None:
        self._send(tau, False)

    def stop(self) -> None:
        if self._control is not None and not self._finished:
            try:
                self._send(np.zeros(7), True)
            except ArmLost:
                return
            self._finished = True

    def _send(self, tau: Array, last: bool) -> None:
        torques = self._library.Torques(tau.tolist())
        torques.motion_finished = last
        try:
            self._control.writeOnce(torques)
        except (RuntimeError, self._library.FrankaException) as error:
            self._finished = True
            raise ArmLost(_told(error)) from None


def _library() -> Any:
    try:
        return import_module("pylibfranka")
    except ImportError as error:
        raise InputError(
            f'a Franka arm needs pylibfranka ({error}): pip install "himpc-lab[franka]" brings it, on Linux'
        ) from None


def _told(error: Exception) -> str:
    """Returns libfranka's error message in one line."""
    return " ".join(str(error).split()).removeprefix("libfranka: ").rstrip(".")

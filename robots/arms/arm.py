"""The interface to an arm that is driven by torques: a real one or a simulated one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robots.errors import InputError
from robots.robot import Robot

Array = NDArray[np.float64]


class Reading(NamedTuple):
    """The reading of an arm, once per period.

    Attributes:
        q, v: measured joint positions, (n,) rad, and velocities, (n,) rad/s.
        tau: the torque without gravity that acted during the last period, (n,) N·m.
        t: the arm's clock, s. It increases by more than one period if periods were missed.
    """

    q: Array
    v: Array
    tau: Array
    t: float


@dataclass(frozen=True, eq=False)
class ArmLimits:
    """The limits of an arm.

    Attributes:
        tau: largest torque without gravity, (n,) N·m.
        tau_rate: largest change of that torque, (n,) N·m/s.
        v: largest joint velocity, (n,) rad/s.
        q_lower, q_upper: joint ranges, (n,) rad.
    """

    tau: Array
    tau_rate: Array
    v: Array
    q_lower: Array
    q_upper: Array

    def with_robot(self, robot: Robot) -> ArmLimits:
        """Returns limits that satisfy both the limits of this arm and those of a robot's description. Raises
        InputError if arm and description have different numbers of joints, or no common range of a joint."""
        if len(self.tau) != robot.n:
            raise InputError(
                f"the arm has {len(self.tau)} joints and the scene's robot '{robot.name}' has {robot.n}: "
                "choose a scene of that arm, such as panda-hold"
            )
        lower, upper = np.maximum(self.q_lower, robot.q_lower), np.minimum(self.q_upper, robot.q_upper)
        for name, low, high in zip(robot.joint_names, lower, upper, strict=True):
            if not low < high:
                raise InputError(
                    f"the arm and the scene's robot '{robot.name}' have no common range of joint '{name}': "
                    "choose a scene of that arm"
                )
        tau, v = np.minimum(self.tau, robot.tau_limit), np.minimum(self.v, robot.v_limit)
        return ArmLimits(tau, self.tau_rate, v, lower, upper)


class ArmLost(Exception):
    """Raised if the arm no longer answers or has stopped by itself. The message contains the arm's own
    message."""


class Arm(ABC):
    """An arm that compensates its own gravity: with a torque of zero it stays at rest, if its load is set
    correctly. All torques exclude gravity. For an arm without compensation, g(q) must be added to torques
    that are sent and subtracted from torques that are read.
    """

    limits: ArmLimits

    @abstractmethod
    def read(self) -> Reading:
        """Waits for the next period and returns its reading. Raises ArmLost."""

    @abstractmethod
    def write(self, tau: Array) -> None:
        """Sets the torque without gravity, (n,) N·m, that acts from now on. Raises ArmLost."""

    @abstractmethod
    def stop(self) -> None:
        """Ends the control by torques: the arm then holds its position by itself. Never raises an
        exception."""

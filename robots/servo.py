"""The plant of a velocity-controlled platform: joint servos track commands in rad/s (m/s)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from robots.plant import Plant
from robots.ranges import Range, Shown, check_fields
from robots.robot import Robot
from robots.settings import PerJoint, PlantSettings
from robots.signals import Motors, PlantState, as_vector

Mode = Literal["ideal", "servo"]

_STEP = 1e-3  # s, control period of the servos


@dataclass(frozen=True)
class VelocityPlantSettings:
    """Parameters of a velocity-controlled plant. The defaults describe ideal kinematics without noise.

    Attributes:
        mode: "ideal": within each step, the velocity changes linearly from its present value to the command,
            so the plant is exactly a sampled double integrator; "servo": MuJoCo's mechanics under velocity
            servos τ = M(q) · bandwidth · (command − v) + C v + g, clipped at the torque limits.
        position_noise: standard deviation of white Gaussian noise on the measured q, rad (m).
        velocity_noise: standard deviation of white Gaussian noise on the measured v, rad/s (m/s).
        payload_kg, friction, damping: as in `PlantSettings`, in "servo" mode only. The servo's model does not
            contain them.

    Raises InputError, which names the field, for values that are not allowed.
    """

    # fmt: off
    mode: Annotated[Mode, Shown(
        "Plant", "ideal: the joints follow the command exactly. servo: MuJoCo's mechanics under joint "
        "velocity servos", group="Plant")] = "ideal"
    bandwidth: Annotated[float, Range(1.0, 300.0), Shown(
        "Bandwidth", "Bandwidth of the velocity servos (servo plant)", "1/s", 1, 300, 1, group="Plant",
    )] = 100.0
    lag_ms: Annotated[float, Range(0.0, 1e3), Shown(
        "Lag", "Time constant of the first-order lag between command and servo", "ms", 0, 300, 5,
        group="Plant")] = 0.0
    delay_ms: Annotated[float, Range(0.0, 1e3), Shown(
        "Delay", "Time after which a command acts", "ms", 0, 300, 5, tries=("1", "2", "0"),
        name="delay of the command, ms", group="Plant")] = 0.0
    position_noise: Annotated[float, Range(0.0, 1.0), Shown(
        "Position noise", "Standard deviation, rad and m", "rad or m", 0, 10, 0.1, page_unit="10⁻³",
        factor=1000.0, group="Plant")] = 0.0
    velocity_noise: Annotated[float, Range(0.0, 10.0), Shown(
        "Velocity noise", "Standard deviation, rad/s and m/s", "rad/s or m/s", 0, 100, 1, page_unit="10⁻³",
        factor=1000.0, group="Plant")] = 0.0
    payload_kg: Annotated[float, Range(0.0, 1e3), Shown(
        "Payload", "A mass at the hand (servo plant)", "kg", 0, 10, 0.5, tries=("3", "1", "2", "5", "0"),
        name="payload, kg", group="Plant")] = 0.0
    friction: Annotated[PerJoint, Range(0.0, 1e4), Shown(
        "Coulomb friction", "Coulomb friction of every joint (servo plant)", "N·m", 0, 20, 0.5, group="Plant",
    )] = 0.0
    damping: Annotated[PerJoint, Range(0.0, 1e4), Shown(
        "Viscous friction", "Viscous friction of every joint (servo plant)", "N·m·s/rad", 0, 20, 0.5,
        group="Plant")] = 0.0
    saturate: Annotated[bool, Shown(
        "Motors saturate", "Clip the torque of the servos at the limits of the data sheet",
        tries=("false", "true"), name="torque bound of the motors", group="Plant")] = True
    # fmt: on

    def __post_init__(self) -> None:
        check_fields(self, "plant.")

    def mechanics(self) -> PlantSettings:
        """Returns the settings of the mechanics that the servos drive."""
        return PlantSettings(
            payload_kg=self.payload_kg, friction=self.friction, damping=self.damping, saturate=self.saturate
        )

    @property
    def latency_ms(self) -> float:
        """Delay between a steadily changing command and the motion, ms: the sum of `delay_ms`, `lag_ms` and
        the delay of the servos."""
        own = 1e3 / self.bandwidth if self.mode == "servo" else 0.0
        return self.delay_ms + self.lag_ms + own


class VelocityPlant:
    """A robot that receives velocity commands. SI units, joints in Pinocchio's order.

    With the same settings, seed and calls, all numbers are bitwise the same.
    """

    def __init__(self, robot: Robot, settings: VelocityPlantSettings | None = None, seed: int = 0) -> None:
        """seed: seed of the measurement noise. Raises InputError for per-joint lists of the wrong length."""
        self.robot = robot
        self.seed = seed
        self.settings = VelocityPlantSettings() if settings is None else settings
        self._plant = Plant(robot, self.settings.mechanics(), _STEP)
        self.reset(robot.home)

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.robot.n

    @property
    def t(self) -> float:
        """Time since the reset, s."""
        return self._t

    @property
    def q(self) -> np.ndarray:
        """(n,) rad or m, the true position."""
        return self._q.copy()

    @property
    def v(self) -> np.ndarray:
        """(n,) rad/s or m/s, the true velocity."""
        return self._v.copy()

    @property
    def tau(self) -> np.ndarray | None:
        """(n,) N·m (N), the torque that acts on the joints; None in "ideal" mode, which has no forces."""
        return self._plant.tau if self.settings.mode == "servo" else None

    def reset(self, q: np.ndarray, v: np.ndarray | None = None) -> None:
        """Sets the state q, v (default 0) and t = 0, as if v had been commanded for a long time.

        Raises ValueError for vectors of the wrong length or with non-finite entries.
        """
        self._q = as_vector("q", q, self.n)
        self._v = np.zeros(self.n) if v is None else as_vector("v", v, self.n)
        self._t = 0.0
        self._plant.reset(self._q, self._v)
        self._commands = Motors(self._v.copy(), 0.0)
        self._random = np.random.default_rng(self.seed)
        self._noise = self._random.standard_normal((2, self.n))

    def configure(self, settings: VelocityPlantSettings) -> None:
        """Changes the plant while it runs; t, q, v and the delayed commands are kept.

        Raises InputError, and changes nothing, for per-joint lists of the wrong length.
        """
        self._plant.configure(settings.mechanics())
        if self.settings.mode == "ideal" and settings.mode == "servo":
            self._plant.reset(self._q, self._v)
        self.settings = settings

    def measure(self) -> PlantState:
        """Returns the measured state. The call changes nothing; the noise changes at every step."""
        settings = self.settings
        q = self._q + settings.position_noise * self._noise[0]
        return PlantState(self._t, q, self._v + settings.velocity_noise * self._noise[1])

    def step(self, command: np.ndarray, period: float) -> np.ndarray:
        """Applies the velocity command (n,) for `period` s; returns the velocity (n,) at the end.

        Raises ValueError, and simulates nothing, if the command is not n finite numbers.
        """
        if not (math.isfinite(period) and period > 0.0):
            raise ValueError(f"the period is {period} s; it must be positive")
        settings = self.settings
        lag, delay = 1e-3 * settings.lag_ms, 1e-3 * settings.delay_ms
        self._commands.command(as_vector("command", command, self.n), self._t)
        direct = settings.mode == "ideal" and lag == 0.0 and delay == 0.0
        count = 1 if direct else max(1, math.ceil(period / _STEP - 1e-9))
        h = period / count
        for _ in range(count):
            wanted = self._commands.advance(self._t, h, delay, lag)
            if settings.mode == "ideal":
                self._q = self._q + 0.5 * h * (self._v + wanted)
                self._v = wanted.copy()
            else:
                self._serve(wanted, h)
            self._t += h
        self._noise = self._random.standard_normal((2, self.n))
        return self._v.copy()

    def _serve(self, wanted: np.ndarray, h: float) -> None:
        """Computes one internal step under the servos' torque."""
        plant = self._plant
        push = self.settings.bandwidth * (wanted - self._v)
        plant.step(plant.mass_matrix() @ push + plant.bias(), h)
        self._q, self._v = plant.q, plant.v

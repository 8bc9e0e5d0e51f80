"""The settings of hierarchical-task MPC; all of them may change while the robot moves."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.base import UNICYCLE, Base, base_joints
from himpc.qp import Solver, is_installed
from himpc.stack import Stack, Weight, check_names
from robots import InputError, Robot
from robots.collision import Obstacle
from robots.ranges import Range, check_fields

Array = NDArray[np.float64]
Formulation = Literal["proximal", "paper"]
Lexicographic = Literal["per_coordinate", "cost"]
FirstLevel = Literal["scaled", "hard", "soft"]

FORMULATIONS: tuple[Formulation, ...] = ("proximal", "paper")
LEXICOGRAPHIC: tuple[Lexicographic, ...] = ("per_coordinate", "cost")
MAX_HORIZON = 40


@dataclass(frozen=True)
class MotionLimits:
    """The feasible sets 𝒳 and 𝒰 of (7d), and the jerk bound of section V-C.

    Attributes:
        position, velocity, acceleration, jerk: which bounds are imposed.
        velocity_scale, acceleration_scale, jerk_scale: factors on the robot's limits, > 0.
        jerk_limit: per joint, rad/s³ (m/s³); None: 10 for the base's joints, 80 for all others.
    """

    position: bool = True
    velocity: bool = True
    acceleration: bool = True
    jerk: bool = True
    velocity_scale: Annotated[float, Range(0.0, above=True)] = 1.0
    acceleration_scale: Annotated[float, Range(0.0, above=True)] = 1.0
    jerk_scale: Annotated[float, Range(0.0, above=True)] = 1.0
    jerk_limit: Annotated[Weight | None, Range(0.0)] = None

    def __post_init__(self) -> None:
        check_fields(self, "limits.")


@dataclass(frozen=True)
class HTMPCSettings:
    """Settings of HTMPC and of its variants with a single task or without preview.

    Attributes:
        stack: levels, highest priority first. The Q of a level weighs its stage costs in (8). The R and the
            horizon of a level, and the gains of its tasks, are not used.
        horizon: N, knots.
        dt: Δt between knots, s.
        rate_hz: control rate, 1/s; the plan is shifted by one control period at every step.
        terminal: P = terminal · Q in (8).
        velocity_effort: S of (10) on the velocities (positions have no weight).
        input_effort: R of (10); None: 0.1 for the base's joints, 0.02 for all others.
        change_effort: W of (10) on Δu; None: 0.1 for the base's joints, 0 for all others.
        formulation: "proximal" (the effort of upper levels is their deviation from the shifted previous plan;
            the rows are hard) or "paper" (every level has the absolute effort (10); relaxed log barriers
            soften the constraints on states and inputs).
        lexicographic: "per_coordinate" for constraint (12), "cost" for constraint (11).
        delta_m: δ of (13), m (or rad): the amount by which the error of a level at a knot may exceed its best
            value at this knot. For (11), δ is converted to the cost of an error δ at every knot.
        max_iter: MAX_ITER, the largest number of QPs per level.
        limits: the bounds to impose.
        obstacles: obstacles of the collision avoidance (7c).
        margin_m: δ_safe of (7c), m.
        self_collision: whether the arm avoids collisions with the base.
        delay_s: delay of a command in s. The measured state is predicted forward by this time. The caller
            samples the references at t + delay_s.
        hold: joints that stay at rest, by name.
        base: how the base moves; see `himpc.htmpc.base.G`.
        gains: used by HTIDKC and placo only, 1/s: ẋ = ṙ + gain · (r − x) at each enabled level. The last gain
            applies to all further levels.
        rho: used by HTIDKC and placo only: ρ, the weight of ‖q̇‖², for HTIDKC at every level.
        first_level: used by placo only: how it treats the first enabled level, see
            `himpc.htmpc.placo_control.Placo`.
        solver: the QP solver, see himpc.qp.Solver. HTIDKC uses it for every QP. HTMPC and its variants use a
            compiled method, and "daqp" if that method finds no solution. Any other value of `solver` replaces
            both.
    """

    stack: Stack
    horizon: Annotated[int, Range(1, MAX_HORIZON)] = 10
    dt: Annotated[float, Range(0.005, 1.0)] = 0.1
    rate_hz: Annotated[float, Range(1.0, 200.0)] = 10.0
    terminal: Annotated[float, Range(0.0, 1e6)] = 10.0
    velocity_effort: Annotated[Weight, Range(0.0)] = 0.1
    input_effort: Annotated[Weight | None, Range(0.0)] = None
    change_effort: Annotated[Weight | None, Range(0.0)] = None
    formulation: Formulation = "proximal"
    lexicographic: Lexicographic = "per_coordinate"
    delta_m: Annotated[float, Range(0.0, 1.0)] = 0.01
    max_iter: Annotated[int, Range(1, 200)] = 1
    limits: MotionLimits = field(default_factory=MotionLimits)
    obstacles: tuple[Obstacle, ...] = ()
    margin_m: Annotated[float, Range(0.0, 1.0)] = 0.05
    self_collision: bool = False
    delay_s: Annotated[float, Range(0.0, 1.0)] = 0.0
    hold: tuple[str, ...] = ()
    base: Base = "holonomic"
    gains: Annotated[tuple[float, ...], Range(0.0)] = (0.5, 0.3)
    rho: Annotated[float, Range(1e-8, 1e3)] = 0.01
    first_level: FirstLevel = "scaled"
    solver: Solver = "daqp"

    def __post_init__(self) -> None:
        check_fields(self)
        if not self.gains or not all(gain <= self.rate_hz for gain in self.gains):
            raise InputError(f"gains are {list(self.gains)}: give numbers from 0 to rate_hz, e.g. 0.5, 0.3")
        if not is_installed(self.solver):
            raise InputError(f"solver '{self.solver}' comes with CasADi: pip install casadi, or use daqp")
        if self.base == "unicycle":
            raise InputError(UNICYCLE)
        check_names(self.stack)

    @property
    def period(self) -> float:
        """Control period, s."""
        return 1.0 / self.rate_hz


@dataclass(frozen=True, eq=False)
class Efforts:
    """Diagonals of S (velocities), R and W of (10), (n,) each."""

    S: Array
    R: Array
    W: Array


@dataclass(frozen=True, eq=False)
class MotionBounds:
    """The bounds that apply, (n,) each; infinite for bounds that are not imposed."""

    q_lower: Array
    q_upper: Array
    v: Array
    a: Array
    j: Array


def efforts(robot: Robot, settings: HTMPCSettings) -> Efforts:
    """Returns the effort weights per joint. Raises InputError for a list of the wrong length or negative
    entries."""
    base = base_joints(robot)
    return Efforts(
        _weights(robot, "velocity_effort", settings.velocity_effort, base, 0.0, 0.0),
        _weights(robot, "input_effort", settings.input_effort, base, 0.1, 0.02),
        _weights(robot, "change_effort", settings.change_effort, base, 0.1, 0.0),
    )


def bounds(robot: Robot, limits: MotionLimits) -> MotionBounds:
    """Returns the robot's limits, scaled and switched by the settings. Raises InputError for a wrong jerk
    list."""
    free = np.full(robot.n, np.inf)
    jerk = _weights(robot, "limits.jerk_limit", limits.jerk_limit, base_joints(robot), 10.0, 80.0)
    return MotionBounds(
        q_lower=robot.q_lower if limits.position else -free,
        q_upper=robot.q_upper if limits.position else free,
        v=robot.v_limit * limits.velocity_scale if limits.velocity else free,
        a=robot.a_max * limits.acceleration_scale if limits.acceleration else free,
        j=jerk * limits.jerk_scale if limits.jerk else free,
    )


def _weights(
    robot: Robot, name: str, value: Weight | None, base: tuple[int, ...], of_base: float, of_arm: float
) -> Array:
    if value is None:
        weights = np.full(robot.n, of_arm)
        weights[list(base)] = of_base
        return weights
    weights = np.asarray(value, float)
    if weights.ndim and weights.shape != (robot.n,):
        raise InputError(f"{name} has {weights.size} entries: '{robot.name}' has {robot.n} joints")
    if not (np.isfinite(weights).all() and (weights >= 0).all()):
        raise InputError(f"{name} is {value}: give finite numbers, at least 0")
    return np.broadcast_to(weights, (robot.n,))

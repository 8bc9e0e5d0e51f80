"""The settings of hierarchical-task MPC, which may all change while the robot moves, and what they mean for a
robot: bounds, weights, and the joints of its base."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np

from himpc.qp import Solver, is_installed
from himpc.stack import Stack, Weight, check_names
from robots import InputError, Robot
from robots.arrays import Array
from robots.collision import Obstacle
from robots.per_robot import per_robot
from robots.ranges import SCALE, Range, Shown, check_fields

Formulation = Literal["proximal", "paper"]
Lexicographic = Literal["per_coordinate", "cost"]
FirstLevel = Literal["scaled", "hard", "soft"]
Base = Literal["holonomic", "unicycle"]

FORMULATIONS: tuple[Formulation, ...] = ("proximal", "paper")
LEXICOGRAPHIC: tuple[Lexicographic, ...] = ("per_coordinate", "cost")
MAX_HORIZON = 40
UNICYCLE = (
    "base is 'unicycle': its G(q) depends on the heading, and the condensed prediction needs G = I; "
    "describe a holonomic base by two prismatic joints and one revolute joint instead"
)
_SCALE = "Factor on the limits of the robot"
_WEIGHTS = Range(0.0, 1e9)
_EFFORT = "Weight in the effort (10), equal for all joints"


@dataclass(frozen=True)
class MotionLimits:
    """The feasible sets 𝒳 and 𝒰 of (7d), and the jerk bound of section V-C."""

    # fmt: off
    position: Annotated[bool, Shown(
        "Position", "Impose the position limits of the joints", name="position limits", group="Limits",
    )] = True
    velocity: Annotated[bool, Shown(
        "Velocity", "Impose the velocity limits", name="velocity limits", group="Limits")] = True
    acceleration: Annotated[bool, Shown(
        "Acceleration", "Impose the acceleration limits", name="acceleration limits", group="Limits")] = True
    jerk: Annotated[bool, Shown("Jerk", "Impose the jerk limits", name="jerk limits", group="Limits")] = True
    velocity_scale: Annotated[float, SCALE, Shown(
        "Velocity scale", _SCALE, "", 0.1, 2.0, 0.05, group="Limits")] = 1.0
    acceleration_scale: Annotated[float, SCALE, Shown(
        "Acceleration scale", _SCALE, "", 0.1, 2.0, 0.05, group="Limits")] = 1.0
    jerk_scale: Annotated[float, SCALE, Shown(
        "Jerk scale", _SCALE, "", 0.1, 2.0, 0.05, group="Limits")] = 1.0
    jerk_limit: Annotated[Weight | None, Range(0.0, 1e9), Shown(
        "Jerk limit", "Jerk limit per joint; null: 10 for the base, 80 for the arm", "rad/s³ or m/s³")] = None
    # fmt: on

    def __post_init__(self) -> None:
        check_fields(self, "limits.")


@dataclass(frozen=True)
class HTMPCSettings:
    """Settings of HTMPC and of its variants with a single task or without preview.

    Attributes:
        stack: levels, highest priority first. The Q of a level weighs its stage costs in (8). The R and the
            horizon of a level, and the gains of its tasks, are not used.
        rate_hz: control rate, 1/s; the plan is shifted by one control period at every step.
        delta_m: δ of (13), m (or rad): the amount by which the error of a level at a knot may exceed its best
            value at this knot. For (11), δ is converted to the cost of an error δ at every knot.
        formulation: "proximal" (the effort of upper levels is their deviation from the shifted previous plan;
            the rows are hard) or "paper" (every level has the absolute effort (10); relaxed log barriers
            soften the constraints on states and inputs).
        terminal: P = terminal · Q in (8).
        velocity_effort: S of (10) on the velocities (positions have no weight).
        input_effort: R of (10); None: 0.1 for the base's joints, 0.02 for all others.
        change_effort: W of (10) on Δu; None: 0.1 for the base's joints, 0 for all others.
        gains: used by HTIDKC and placo only, 1/s: ẋ = ṙ + gain · (r − x) at each enabled level. The last gain
            applies to all further levels.
        rho: used by HTIDKC and placo only: ρ, the weight of ‖q̇‖², for HTIDKC at every level.
        first_level: used by placo only: how it treats the first enabled level, see
            `himpc.htmpc.placo_control.Placo`.
        obstacles: obstacles of the collision avoidance (7c).
        delay_s: delay of a command in s. The measured state is predicted forward by this time. The caller
            samples the references at t + delay_s.
        base: how the base moves. "holonomic": by two prismatic joints along world axes and a revolute joint,
            so that its velocities are world velocities and G(q) of (4) is the identity, as for an arm.
        solver: the QP solver, see himpc.qp.Solver. HTIDKC uses it for every QP. HTMPC and its variants use a
            compiled method, and "daqp" if that method finds no solution. Any other value of `solver` replaces
            both.
    """

    stack: Stack
    # fmt: off
    horizon: Annotated[int, Range(1, MAX_HORIZON), Shown(
        "N", "Number of knots of the prediction horizon", low=1, high=40, tries=("1", "2", "5", "10", "20"),
        name="horizon N", group="Horizon")] = 10
    dt: Annotated[float, Range(0.005, 1.0), Shown(
        "Δt", "Time between two knots", "s", 20, 300, 10, page_unit="ms", factor=1000.0, group="Horizon",
    )] = 0.1
    rate_hz: Annotated[float, Range(1.0, 200.0), Shown(
        "Rate", "Control steps per second; 10 in the paper", "Hz", 2, 50, 1, group="Horizon")] = 10.0
    delta_m: Annotated[float, Range(0.0, 1.0), Shown(
        "δ", "Amount by which a lower level may increase the error of a higher level at a knot, (13)", "m", 0,
        100, 1, page_unit="mm", factor=1000.0, tries=("0.002", "0.02", "0.05"), name="δ of (13), m",
        group="How strict")] = 0.01
    formulation: Annotated[Formulation, Shown(
        "Formulation",
        "paper: the cost of every level contains the absolute effort (10). proximal: the cost of upper "
        "levels contains the deviation from the previous plan instead", group="How strict")] = "proximal"
    lexicographic: Annotated[Lexicographic, Shown(
        "Lexicographic", "per_coordinate: (12), bounds every error. cost: (11), bounds the cost of the level",
        group="How strict")] = "per_coordinate"
    max_iter: Annotated[int, Range(1, 200), Shown(
        "MAX_ITER", "Largest number of QPs per level and control step", low=1, high=10, group="How strict",
    )] = 1
    terminal: Annotated[float, Range(0.0, 1e6), Shown(
        "P / Q", "Weight of the last knot relative to the others, (8)", "", 0, 100, 1)] = 10.0
    velocity_effort: Annotated[Weight, _WEIGHTS, Shown("S velocities", _EFFORT, "", 0.0, 2.0, 0.01)] = 0.1
    input_effort: Annotated[Weight | None, _WEIGHTS, Shown("R inputs", _EFFORT, "", 0.0, 1.0, 0.01)] = None
    change_effort: Annotated[Weight | None, _WEIGHTS, Shown(
        "W changes", _EFFORT, "", 0.0, 1.0, 0.01)] = None
    gains: Annotated[tuple[float, ...], Range(0.0, 1e4), Shown(
        "Gains", "Gains of HTIDKC and placo, one per level: ẋ = ṙ + gain · (r − x)", "1/s",
    ), Shown("Gain of level *", "ẋ = ṙ + gain · (r − x)", "1/s", 0.0, 3.0, 0.05)] = (0.5, 0.3)
    rho: Annotated[float, Range(1e-8, 1e3), Shown(
        "ρ", "Weight of ‖q̇‖² in every level of HTIDKC, and in the QP of placo", low=0.001, high=1.0,
        log=True)] = 0.01
    first_level: Annotated[FirstLevel, Shown(
        "First level of placo",
        "scaled: kept exactly, with a velocity that is reduced as far as the limits require. hard: kept "
        "exactly, or the robot brakes. soft: weighed by its Q like the other levels")] = "scaled"
    limits: MotionLimits = field(default_factory=MotionLimits)
    obstacles: tuple[Obstacle, ...] = ()
    margin_m: Annotated[float, Range(0.0, 1.0), Shown(
        "Margin", "Smallest distance that the robot keeps from obstacles, (7c)", "m", 0, 50, 1,
        page_unit="cm", factor=100.0, group="Limits")] = 0.05
    self_collision: Annotated[bool, Shown(
        "Keep the arm clear of the base", "Hand and forearm avoid collisions with the platform",
        group="Limits")] = False
    delay_s: Annotated[float, Range(0.0, 1.0)] = 0.0
    hold: Annotated[tuple[str, ...], Shown("Hold", "Names of the joints that stay at rest")] = ()
    base: Annotated[Base, Shown("Base", "Type of motion of the base")] = "holonomic"
    solver: Annotated[Solver, Shown(
        "QP solver", "daqp: used by HTIDKC, and by the other controllers if the compiled method finds no "
        "solution. proxqp and qpoases solve all QPs")] = "daqp"
    # fmt: on

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


@per_robot
def base_joints(robot: Robot) -> tuple[int, ...]:
    """Returns the columns of the joints of a mobile base: the unbounded joints at the root of the tree."""
    count = 0
    for joint in range(1, robot.n + 1):
        chained = robot.model.parents[joint] == joint - 1 and robot.joints[joint - 1] == joint
        if not chained or np.isfinite(robot.q_lower[joint - 1]) or np.isfinite(robot.q_upper[joint - 1]):
            break
        count = joint
    return tuple(range(count)) if count >= 3 else ()


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

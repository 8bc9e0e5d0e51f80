"""HIMPC: hierarchical incremental MPC, sections III and IV of the paper."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from time import perf_counter_ns
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.cascade import ROUTES, Route, solve_cascade
from himpc.cascade.level import NO_ROWS, LevelProblem, LevelSolution
from himpc.configuration import Configuration
from himpc.controllers.forms import LevelForm, level_forms
from himpc.controllers.memory import Memory
from himpc.limits import Limits, LimitsInForce, build_rows, in_force, ramp
from himpc.plan import Plan
from himpc.prediction.joint import JointState, predict_positions
from himpc.qp import SOLVERS, Solver
from himpc.references import Preview
from himpc.stack import DAMPING_LEVEL, Stack, active_levels, check_names, freedom_left
from robots import InputError, Robot
from robots.errors import unknown_name

Array = NDArray[np.float64]

MAX_HORIZON = 60
ENABLE_SECONDS = 0.5
_FAINTEST = 1e-8
"""A level switched on starts with this share of its Q and gains decades at a constant rate."""


@dataclass(frozen=True)
class Settings:
    """Everything about HIMPC that may change while the robot moves.

    Attributes:
        stack: levels, highest priority first.
        horizon: N ≥ 1 knots; 1 is HIQP.
        T_s: control period, s.
        M_bar: diagonal of M̄, one per joint, kg·m².
        limits: bounds to impose.
        route: "structured" (fast) or "explicit" (all rows as printed).
        solver: "daqp" or "proxqp".
        R_on: what R in (31) weighs: the "torque" increments Δτ as printed, or the "acceleration" M̄⁻¹Δτ.
        damping: add the damping level whenever the enabled levels leave freedom.
    """

    stack: Stack
    M_bar: tuple[float, ...]
    horizon: int = 5
    T_s: float = 1e-3
    limits: Limits = field(default_factory=Limits)
    route: Route = "structured"
    solver: Solver = "daqp"
    R_on: Literal["torque", "acceleration"] = "torque"
    damping: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.horizon <= MAX_HORIZON:
            raise InputError(f"horizon is {self.horizon}: give a whole number from 1 to {MAX_HORIZON}")
        if not 1e-4 <= self.T_s <= 0.02:
            raise InputError(f"T_s is {self.T_s} s: give a period from 0.0001 to 0.02, e.g. 0.001")
        if not all(math.isfinite(value) and value > 0 for value in self.M_bar):
            raise InputError(f"M_bar is {list(self.M_bar)}: every entry must be a finite number above 0")
        for name, choices in (("route", ROUTES), ("solver", SOLVERS), ("R_on", ("torque", "acceleration"))):
            if getattr(self, name) not in choices:
                raise unknown_name(name, str(getattr(self, name)), choices)
        check_names(self.stack)


class HIMPC:
    """The controller. It reads geometry and limits of the robot, never a mass: the model is time-delay estimation.

    One `step` per period T_s. What it remembers between steps is the torque that was applied (τ₀), the
    previous velocities (for q̈ and ẍ by backward difference) and the previous plan (for the Jacobians
    along the prediction). `configure` changes settings and keeps all of it.
    """

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
        """Forgets plan and memory; τ₀ (n,) N·m is the torque acting now, and q̈ and ẍ start at zero."""
        self._tau_0 = np.array(tau_0, float)
        self._memory: Memory | None = None
        unbounded = in_force(self.robot, Limits(torque=False, velocity=False, position="off"))
        self._limits = unbounded
        self._weight = {form.level.name: 1.0 for form in self._forms}

    def configure(self, settings: Settings) -> None:
        """Takes new settings at once. Raises InputError, and changes nothing, if they do not fit the robot."""
        before = {form.level.name for form in self._forms}
        self._apply(settings)
        for form in self._forms:
            if form.level.name not in before and form.level is not DAMPING_LEVEL:
                self._weight[form.level.name] = 0.0

    def _apply(self, settings: Settings) -> None:
        if len(settings.M_bar) != self.robot.n:
            raise InputError(
                f"M_bar has {len(settings.M_bar)} entries: robot '{self.robot.name}' has {self.robot.n} joints"
            )
        freedom = freedom_left(self.robot, settings.stack)
        active = active_levels(settings.stack, settings.damping, freedom)
        levels = active or (DAMPING_LEVEL,)
        every = level_forms(self.robot, (*settings.stack, DAMPING_LEVEL), settings)
        self._forms = [form for form in every if form.level in levels]
        self._others = [form for form in every if form.level not in levels and form.level is not DAMPING_LEVEL]
        self._last_rung = every[-1]
        self._M_bar = np.array(settings.M_bar)
        self._idle = not active
        self._goal = in_force(self.robot, settings.limits)
        self._settings = settings

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """One control period: measured state in, torque and evidence out.

        Args:
            q, v: measured joint positions and velocities, (n,).
            previews: the reference of every task by its name, sampled at this tick with T_s and N.
            tau_applied: the torque that acted during the last period, (n,) N·m; None: the one asked for.

        Returns:
            the plan. Whatever the state, its torque is finite and inside the torque bounds; a state
            that is not finite holds the last torque.
        """
        started = perf_counter_ns()
        if tau_applied is not None and np.isfinite(tau_applied).all():
            self._tau_0 = np.array(tau_applied, float)
        settings, T_s, N = self._settings, self._settings.T_s, self._settings.horizon
        if not _usable(q) or not _usable(v):
            return self._hold(q, started)
        memory = self._memory or Memory.start(q, v, T_s)
        state = JointState(q, v, (v - memory.v) / memory.period)
        self._limits = ramp(self._limits, self._goal, self._tau_0, q, v, T_s)
        with np.errstate(all="ignore"):
            configuration = Configuration(self.robot, self._data, q, v, memory.knots(q, v, N, T_s))
            values: dict[str, Array] = {}
            errors: dict[str, Array] = {}
            velocities: dict[str, Array] = {}
            problems = [
                self._problem(form, configuration, memory, previews, values, errors, velocities)
                for form in self._forms
            ]
            for form in self._others:
                form.measure(configuration, previews, values, errors)
            rows = build_rows(state, self._tau_0, self._M_bar, settings.limits, self._limits, N, T_s)
            if not all(math.isfinite(float(problem.free.sum())) for problem in problems):
                return self._hold(q, started)

            def last_rung() -> LevelProblem:
                return self._problem(self._last_rung, configuration, memory, previews, {}, {}, {})

            if self._idle:
                # No level is on and damping is off: nothing is asked for, so the torque stays.
                problems = []
            solutions = (
                solve_cascade(problems, rows, memory.solutions, last_rung, settings.route, settings.solver)
                if problems
                else []
            )
        U = solutions[-1].U if solutions else np.zeros((N, self.robot.n))
        tau = np.clip(self._tau_0 + U[0], self._limits.tau_lower, self._limits.tau_upper)
        if not np.isfinite(tau).all():
            return self._hold(q, started)
        predicted_q = predict_positions(state, U, self._M_bar, T_s)
        self._memory = Memory(q, v, T_s, velocities, predicted_q, {s.name: s for s in solutions})
        plan = Plan(
            tau=tau,
            tau_0=self._tau_0,
            levels=tuple(solutions),
            q=predicted_q,
            errors=errors,
            values=values,
            rows=rows,
            limits=self._limits,
            step_us=(perf_counter_ns() - started) / 1e3,
            unsolved=sum(solution.rung != "solve" for solution in solutions),
        )
        self._tau_0 = tau
        return plan

    def _problem(
        self,
        form: LevelForm,
        configuration: Configuration,
        memory: Memory,
        previews: Mapping[str, Preview],
        values: dict[str, Array],
        errors: dict[str, Array],
        velocities: dict[str, Array],
    ) -> LevelProblem:
        J = form.jacobian(configuration)
        velocity = J[0] @ configuration.v
        name = form.level.name
        before = memory.task_velocities.get(name)
        if before is None:
            past = Configuration(self.robot, self._data, memory.q, memory.v)
            before = form.jacobian(past)[0] @ memory.v
        velocities[name] = velocity
        error = form.measure(configuration, previews, values, errors)
        free = form.free(error, velocity, (velocity - before) / memory.period, previews)
        return LevelProblem(
            name=name,
            B=J / self._M_bar,
            C=form.model.C,
            free=free,
            root_Q=form.root_Q * self._faded(name),
            R=form.R,
            knots=form.knots,
        )

    def _faded(self, name: str) -> float:
        """√ of the share of Q that a level has; a level switched on fades in over ENABLE_SECONDS."""
        weight = self._weight.get(name, 1.0)
        if weight >= 1.0:
            return 1.0
        self._weight[name] = min(1.0, weight + self._settings.T_s / ENABLE_SECONDS)
        return math.sqrt(_FAINTEST ** (1.0 - weight))

    def _hold(self, q: Array, started: int) -> Plan:
        """The plan for a tick without a usable state: keep the torque, forget the memory."""
        N, n = self._settings.horizon, self.robot.n
        self._memory = None
        limits: LimitsInForce = self._limits
        tau = np.clip(self._tau_0, limits.tau_lower, limits.tau_upper)
        still = np.zeros((N, n))
        name = self._forms[0].level.name
        held = LevelSolution(name, still, math.nan, NO_ROWS, 0.0, "state not finite", "hold", 0.0, 0.0)
        state = JointState(np.zeros(n), np.zeros(n), np.zeros(n))
        self._tau_0 = tau
        return Plan(
            tau=tau,
            tau_0=tau,
            levels=(held,),
            q=np.tile(q, (N + 1, 1)),
            errors={},
            values={},
            rows=build_rows(
                state, tau, self._M_bar, self._settings.limits, limits, N, self._settings.T_s
            ),
            limits=limits,
            step_us=(perf_counter_ns() - started) / 1e3,
            unsolved=1,
        )


def _usable(x: Array) -> bool:
    """Finite, and small enough that its squares and the bounds' differences stay so."""
    return float(np.abs(x).max()) < 1e9

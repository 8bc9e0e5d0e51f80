"""HIMPC: hierarchical incremental MPC, sections III and IV of the paper."""

from __future__ import annotations

import math
from collections.abc import Mapping
from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.cascade import solve_cascade
from himpc.cascade.level import NO_ROWS, LevelProblem, LevelSolution
from himpc.controllers.adaptation import Adaptation, LoadModel, adapted
from himpc.controllers.base import TorqueController
from himpc.controllers.period import PeriodResult, PeriodState
from himpc.controllers.stall_guard import guard_of
from himpc.formulation.forms import LevelForm, Prepared, StackForm, measure, prepare, usable
from himpc.formulation.memory import Memory
from himpc.formulation.settings import Settings, check_solver
from himpc.kinematics.configuration import Configuration
from himpc.limits import LimitsInForce, build_rows, in_force, ramp
from himpc.plan import Evidence, Plan
from himpc.prediction.joint import JointState, predict_positions
from himpc.references import Preview
from himpc.references.outlook import observed_by
from himpc.stack import DAMPING_LEVEL, about
from himpc.tick.distances import Distances
from himpc.tick.tables import LevelTable
from himpc.tick.tick import CompiledTick

Array = NDArray[np.float64]

ENABLE_SECONDS = 0.5
FAINTEST = 1e-8
"""A task that is switched on starts with this share of its Q. The share grows exponentially to 1."""


class HIMPC(TorqueController):
    """HIMPC with time-delay estimation instead of a dynamic model: it uses geometry and limits of the robot,
    but no masses. (Only with `M_bar_adapt` the nominal model determines M̄.)

    Call `step` once per period T_s. Between steps the controller stores the torque that was applied (τ₀), the
    previous velocities (for q̈ and ẍ by backward difference) and the previous plan (for the Jacobians along
    the prediction). `configure` changes settings and keeps these data.
    """

    @property
    def problems(self) -> list[LevelProblem]:
        """The problems of the last tick, one per level, highest priority first; empty if no level is enabled
        or no tick has been solved."""
        if self._idle:
            return []
        return self._asked if self.kernel is None else self.kernel.problems()

    def reset(self, tau_0: Array) -> None:
        """Clears plan and memory; τ₀ (n,) N·m is the torque acting now, and q̈ and ẍ start at zero."""
        super().reset(tau_0)
        self._memory: Memory | None = None
        self._guard = guard_of(self._settings, len(self._form.tasks), self.robot)
        self._asked: list[LevelProblem] = []
        if self.kernel is not None:
            self.kernel.forget()
        self._adaptation: Adaptation | None = None
        self._weight: dict[str, float] = {}

    def configure(self, settings: Settings) -> None:
        """Applies new settings immediately. If they do not fit the robot, it raises InputError and changes
        nothing."""
        before = [about(task) for task in self._form.tasks]
        same = settings.M_bar == self._settings.M_bar and settings.T_s == self._settings.T_s
        measured_so_far = self._adaptation if same and settings.M_bar_adapt else None
        memory = self._memory if self.kernel is None else self.kernel.memory
        self._apply(settings)
        self._memory, self._adaptation = memory, measured_so_far
        if self.kernel is not None and self._memory is not None:
            self.kernel.recall(self._memory, self._memory.q, self._memory.v)
        self._weight = {name: weight for name, weight in self._weight.items() if weight < 1.0}
        for form in self._form.levels:
            for task in form.level.tasks:
                if form.level is not DAMPING_LEVEL and about(task) not in before:
                    self._weight[task.name] = 0.0

    def _apply(self, settings: Settings) -> None:
        explicit, avoidance = settings.route == "explicit", settings.limits.avoidance
        check_solver(settings, explicit)
        prepared = prepare(self.robot, settings)
        goal = in_force(self.robot, settings.limits)
        guard = guard_of(settings, len(prepared.form.tasks), self.robot)
        load = LoadModel(self.robot, settings.nominal) if settings.M_bar_adapt else None
        distances = Distances(self.robot, avoidance) if explicit and avoidance.on else None
        kernel = None if explicit else self._compile(settings, prepared)
        # Everything that may raise is above.
        self._form, self._idle, self._off = prepared
        self._settings, self._goal, self._guard, self._load = settings, goal, guard, load
        self._distances, self.kernel = distances, kernel
        self._M_bar = self._M_bar_set = np.array(settings.M_bar)
        self._still = np.zeros((settings.horizon, self.robot.n))
        # A joint's torque cannot exceed its limit. A larger reading is wrong, and bounds must not start from
        # it.
        self._reach = np.maximum(self.robot.tau_limit, goal.tau_upper)

    def _compile(self, settings: Settings, prepared: Prepared) -> CompiledTick:
        """Creates the compiled tick."""
        levels = [] if prepared.idle else [LevelTable.of(level) for level in prepared.form.levels]
        return CompiledTick(self.robot, settings, prepared.form, prepared.off, levels)

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """Computes one control period: the torque and its evidence from the measured state.

        Args:
            q, v: measured joint positions and velocities, (n,).
            previews: the reference of every task by its name, sampled at this tick with T_s and N.
            tau_applied: the torque that acted during the last period, (n,) N·m; None: the commanded torque.

        Returns:
            the plan. For every state its torque is finite and inside the torque bounds; if the state is not
            finite, the last torque is held.
        """
        started = perf_counter_ns()
        if tau_applied is not None and usable(tau_applied):
            self._tau_0 = np.minimum(np.maximum(tau_applied, -self._reach), self._reach)
        settings, T_s, N = self._settings, self._settings.T_s, self._settings.horizon
        if not usable(q) or not usable(v):
            return self._hold(q, started)
        if settings.M_bar_adapt:
            self._adapt(q)
        if self.kernel is not None:
            return self._step_compiled(self.kernel, q, v, previews, started)
        memory = self._memory or Memory.start(q, v, T_s)
        state = JointState(q, v, (v - memory.v) / memory.period)
        self._limits = ramp(self._limits, self._goal, self._tau_0, q, v, T_s)
        limits = self._slowed(v)
        values: dict[str, Array] = {}
        errors: dict[str, Array] = {}
        with np.errstate(all="ignore"):
            if self._off:
                here = Configuration(self.robot, self._data, q, v, previews=previews)
                measure(self._off, here, previews, values, errors)
            near = self._distances and self._distances.at(q, observed_by(previews))
            rows = build_rows(state, self._tau_0, self._M_bar, settings.limits, limits, N, T_s, near)
            found = self._search(PeriodState(state, memory, previews, rows, values, errors))
        if found is None:
            return self._hold(q, started)
        solutions, predicted_q = found.solutions, found.predicted_q
        first = solutions[-1].U[0] if solutions else 0.0
        if self._guard is not None:
            self._guard.errors, self._guard.fastest = self._form.lengths(errors), self._form.fastest(previews)
        tau = np.minimum(np.maximum(self._tau_0 + first, limits.tau_lower), limits.tau_upper)
        if not usable(tau):
            return self._hold(q, started)
        by_name = {solution.name: solution for solution in solutions}
        self._memory = Memory(q, v, T_s, found.x_dot, self._form, predicted_q, by_name)
        evidence = Evidence(tuple(solutions), predicted_q, errors, values, rows)
        plan = Plan(
            tau=tau,
            tau_0=self._tau_0,
            limits=limits,
            step_us=(perf_counter_ns() - started) / 1e3,
            unsolved=sum(solution.fallback != "solve" for solution in solutions),
            find_evidence=lambda: evidence,
            iterations=found.iterations,
            M_bar=self._M_bar if settings.M_bar_adapt else None,
        )
        self._tau_0 = tau
        return plan

    def _step_compiled(
        self, tick: CompiledTick, q: Array, v: Array, previews: Mapping[str, Preview], started: int
    ) -> Plan:
        """Computes `step` by the compiled kernel."""
        self._limits = ramp(self._limits, self._goal, self._tau_0, q, v, self._settings.T_s)
        if self._weight:
            for place, level in enumerate(self._form.levels):
                tick.fade(place, self._faded(level))
        plan = tick.step(q, v, previews, self._tau_0, self._slowed(v), started)
        if plan is None:
            return self._hold(q, started)
        if self._guard is not None:
            self._guard.errors, self._guard.fastest = tick.progress()
        self._tau_0 = plan.tau
        return plan

    def _slowed(self, v: Array) -> LimitsInForce:
        """Returns the limits in force, in which a guard may lower the velocity limits."""
        if self._guard is None:
            return self._limits
        distances = self._distances if self.kernel is None else self.kernel.distances
        limits = self._guard.limits(self._limits, self._tau_0, v, distances)
        if self.kernel is not None:
            self.kernel.pull(self._guard.largest_error)
        return limits

    def _adapt(self, q: Array) -> None:
        """Adapts M̄ to the torque that acted."""
        settings = self._settings
        assert self._load is not None
        before = self._adaptation or Adaptation(self._M_bar_set)
        self._adaptation = adapted(before, self._load, q, self._tau_0, settings.T_s, self._M_bar_set)
        self._M_bar = self._adaptation.M_bar
        if self.kernel is not None:
            self.kernel.take_M_bar(self._M_bar)

    def _search(self, tick: PeriodState) -> PeriodResult | None:
        """Returns the plan with the Jacobians at the configurations of the previous prediction (30); None
        if its problems are not finite."""
        state, settings = tick.state, self._settings
        return self._solve(tick, tick.memory.knots(state.q, state.v, settings.horizon, settings.T_s))

    def _solve(self, tick: PeriodState, knots: Array) -> PeriodResult | None:
        """Solves the cascade with the Jacobians at q_k and at `knots`, (N−1, n)."""
        state, memory, settings = tick.state, tick.memory, self._settings
        configuration = Configuration(self.robot, self._data, state.q, state.v, knots, tick.previews)
        problems, x_dot = self._problems(
            self._form, configuration, memory, tick.previews, tick.values, tick.errors
        )
        if problems is None:
            return None
        if self._idle:
            # Without any enabled level and without damping the torque is held.
            return PeriodResult([], x_dot, predict_positions(state, self._still, self._M_bar, settings.T_s))

        self._asked = problems
        solutions = self._cascade(problems, tick)
        return PeriodResult(
            solutions, x_dot, predict_positions(state, solutions[-1].U, self._M_bar, settings.T_s)
        )

    def _cascade(self, problems: list[LevelProblem], tick: PeriodState) -> list[LevelSolution]:
        """Solves Problem 1 to Problem r."""
        return solve_cascade(problems, tick.rows, tick.memory.solutions, self._settings.solver)

    def _problems(
        self,
        form: StackForm,
        configuration: Configuration,
        memory: Memory,
        previews: Mapping[str, Preview],
        values: dict[str, Array],
        errors: dict[str, Array],
    ) -> tuple[list[LevelProblem] | None, Array]:
        """Returns two results: the QP data of all levels of a form (None if the data are not finite), and ẋ_k
        of all rows."""
        J = form.jacobian(configuration)
        x_dot = J[0] @ configuration.v
        before = memory.x_dot
        if before is None or memory.form is not form:
            past = Configuration(self.robot, self._data, memory.q, memory.v, previews=previews)
            before = form.jacobian(past)[0] @ memory.v
        error = measure(form.tasks, configuration, previews, values, errors)
        asked = form.asked(configuration, previews)
        pull = (self._guard or self._settings.limits.avoidance).largest_error
        error = form.pulling(error, pull) if math.isfinite(pull) else error
        free = form.free(error, x_dot, (x_dot - before) / memory.period, asked, configuration.horizon)
        if not math.isfinite(float(free.sum())):
            return None, x_dot
        B = J / self._M_bar
        weighted = form.root_Q * free
        problems = [level.problem(B, free, weighted, self._faded(level)) for level in form.levels]
        return problems, x_dot

    def _faded(self, level: LevelForm) -> float | Array:
        """Returns the square root of the share of Q that is in effect for a level: one number, or one per row
        if the shares of its tasks differ. The share of a task that is new or was just switched on grows to 1
        over ENABLE_SECONDS."""
        tasks = level.level.tasks
        if all(self._weight.get(task.name, 1.0) >= 1.0 for task in tasks):
            return 1.0
        return np.repeat([self._share(task.name) for task in tasks], level.sizes)

    def _share(self, name: str) -> float:
        weight = self._weight.get(name, 1.0)
        if weight >= 1.0:
            return 1.0
        self._weight[name] = min(1.0, weight + self._settings.T_s / ENABLE_SECONDS)
        return math.sqrt(FAINTEST ** (1.0 - weight))

    def _hold(self, q: Array, started: int) -> Plan:
        """Returns the plan for a tick without a usable state: the torque is held and the memory is
        cleared."""
        N, n = self._settings.horizon, self.robot.n
        self._memory = self._adaptation = None
        if self.kernel is not None:
            self.kernel.forget()
        limits: LimitsInForce = self._limits
        tau = np.clip(self._tau_0, limits.tau_lower, limits.tau_upper)
        still = np.zeros((N, n))
        name = self._form.levels[0].name
        held = LevelSolution(name, still, math.nan, NO_ROWS, 0.0, "state not finite", "hold", 0.0, 0.0, 0.0)
        state = JointState(np.zeros(n), np.zeros(n), np.zeros(n))
        self._tau_0 = tau
        rows = build_rows(state, tau, self._M_bar, self._settings.limits, limits, N, self._settings.T_s)
        evidence = Evidence((held,), np.tile(q, (N + 1, 1)), {}, {}, rows)
        return Plan(
            tau=tau,
            tau_0=tau,
            limits=limits,
            step_us=(perf_counter_ns() - started) / 1e3,
            unsolved=1,
            find_evidence=lambda: evidence,
        )

"""HIMPC: hierarchical incremental MPC, sections III and IV of the paper."""

from __future__ import annotations

import math
from collections.abc import Mapping
from time import perf_counter_ns

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import NO_ROWS, LevelProblem, LevelSolution
from himpc.controllers.adaptation import Adaptation, LoadModel, adapted
from himpc.controllers.base import TorqueController
from himpc.controllers.printed_tick import PrintedTick
from himpc.controllers.stall_guard import Guard, guard_of
from himpc.formulation.forms import LevelForm, Prepared, prepare, usable
from himpc.formulation.settings import Settings, check_solver, same_structure
from himpc.limits import LimitsInForce, build_rows, in_force, ramp
from himpc.plan import Evidence, Plan
from himpc.prediction import JointState
from himpc.references import Preview
from himpc.stack import DAMPING_LEVEL, about
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

    _prepared: Prepared | None = None
    _guard: Guard | None = None
    solves = False
    """Whether a general QP solver is used, the one in `Settings.solver`."""

    @property
    def problems(self) -> list[LevelProblem]:
        """The problems of the last tick, one per level, highest priority first; empty if no level is enabled
        or no tick has been solved."""
        return [] if self._prepared is None or self._prepared.idle else self.kernel.problems()

    def reset(self, tau_0: Array) -> None:
        """Clears plan and memory; τ₀ (n,) N·m is the torque acting now, and q̈ and ẍ start at zero."""
        super().reset(tau_0)
        self._guard = guard_of(self._settings, len(self._form.tasks), self.robot)
        self.kernel.forget()
        self._adaptation: Adaptation | None = None
        self._weight: dict[str, float] = {}
        self._fade()

    def configure(self, settings: Settings) -> None:
        """Applies new settings immediately. If they do not fit the robot, it raises InputError and changes
        nothing."""
        form, kernel = self._form, self.kernel
        same = settings.M_bar == self._settings.M_bar and settings.T_s == self._settings.T_s
        measured_so_far = self._adaptation if same and settings.M_bar_adapt else None
        self._apply(settings)
        self._adaptation = measured_so_far
        self._weight = {name: weight for name, weight in self._weight.items() if weight < 1.0}
        if self.kernel is kernel:
            return
        memory = kernel.memory
        if memory is not None:
            self.kernel.recall(memory, memory.q, memory.v)
        before = [about(task) for task in form.tasks]
        for level in self._form.levels:
            for task in level.level.tasks:
                if level.level is not DAMPING_LEVEL and about(task) not in before:
                    self._weight[task.name] = 0.0

    def _apply(self, settings: Settings) -> None:
        check_solver(settings, self.solves)
        before = self._prepared if same_structure(settings, self._settings) else None
        prepared = prepare(self.robot, settings, before)
        same = before is not None and settings.limits == self._settings.limits
        goal = self._goal if same else in_force(self.robot, settings.limits)
        guard = guard_of(settings, len(prepared.form.tasks), self.robot, self._guard)
        load = LoadModel(self.robot, settings.nominal) if settings.M_bar_adapt else None
        kernel = self._compile(settings, prepared) if before is None else self.kernel
        # Everything that may raise is above.
        if before is not None:
            kernel.change(settings, prepared)
        self._prepared, self._form, self.kernel = prepared, prepared.form, kernel
        self._settings, self._goal, self._guard, self._load = settings, goal, guard, load
        self._M_bar = self._M_bar_set = np.array(settings.M_bar)
        # A joint's torque cannot exceed its limit. A larger reading is wrong, and bounds must not start from
        # it.
        self._reach = np.maximum(self.robot.tau_limit, goal.tau_upper)

    def _compile(self, settings: Settings, prepared: Prepared) -> CompiledTick | PrintedTick:
        """Creates the tick that solves the levels."""
        return CompiledTick(self.robot, settings, prepared)

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
        if not usable(q) or not usable(v):
            return self._hold(q, started)
        if self._load is not None:
            self._adapt(q, self._load)
        self._limits = ramp(self._limits, self._goal, self._tau_0, q, v, self._settings.T_s)
        if self._weight:
            self._fade()
        plan = self.kernel.step(q, v, previews, self._tau_0, self._slowed(v), started)
        if plan is None:
            return self._hold(q, started)
        if self._guard is not None:
            self._guard.errors, self._guard.fastest = self.kernel.progress()
        self._tau_0 = plan.tau
        return plan

    def _slowed(self, v: Array) -> LimitsInForce:
        """Returns the limits in force, in which a guard may lower the velocity limits."""
        if self._guard is None:
            return self._limits
        limits = self._guard.limits(self._limits, self._tau_0, v, self.kernel.distances)
        self.kernel.pull(self._guard.largest_error)
        return limits

    def _adapt(self, q: Array, load: LoadModel) -> None:
        """Adapts M̄ to the torque that acted."""
        before = self._adaptation or Adaptation(self._M_bar_set)
        self._adaptation = adapted(before, load, q, self._tau_0, self._settings.T_s, self._M_bar_set)
        self._M_bar = self._adaptation.M_bar
        self.kernel.take_M_bar(self._M_bar)

    def _fade(self) -> None:
        for index, level in enumerate(self._form.levels):
            self.kernel.fade(index, self._faded(level))

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
        self._adaptation = None
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

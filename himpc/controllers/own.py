"""Runs a user's own controller, which receives a `View` at every tick and returns a torque."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from time import perf_counter_ns
from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.controllers.answers import OwnFault, checked, next_cost, no_rows, solution
from himpc.controllers.base import TorqueController
from himpc.controllers.one_step import leak as leak_of
from himpc.controllers.view import View, read_only
from himpc.controllers.viewer import Viewer
from himpc.formulation.forms import prepare, usable
from himpc.formulation.settings import Settings, check_solver
from himpc.limits import LimitsInForce, in_force, ramp
from himpc.plan import Evidence, Plan
from himpc.references import Preview
from robots import Robot

Array = NDArray[np.float64]

Law = Callable[[View], Any]
"""A user's control law: a function that is called once per tick."""
Calling = Callable[[Law, View], Any]
"""Calls the law. Raises OwnFault with one sentence if the call fails."""

REST = 5.0
"""1/s: rate at which the robot comes to rest after the user's law has failed. The torque is then τ = τ₀ − M̄
(q̈ + REST · q̇), which damps the remaining motion."""
OPENING_SECONDS = 0.3
"""s: time after a change of settings until the law's torque is applied in full."""
_FIRST_SHARE = 0.02


class OwnController(TorqueController):
    """Runs a user's control law. It prepares the law's view, applies the bounds in force and collects the
    evidence.

    The law returns a torque (n,) N·m, or one row per level (r, n): row i is the torque that levels 1 to i
    would apply. The last row acts. With a row per level, the leak between levels (33) is also computed, with
    M̄.

    The law fails if it raises an exception, or returns a wrong shape or a number that is not finite. The
    torque is then held and damped until `reset`, and `Plan.notice` of this tick describes the failure.
    """

    def __init__(
        self, robot: Robot, settings: Settings, make: Callable[[], Law], call: Calling, where: str
    ) -> None:
        """Raises InputError if the settings do not fit the robot.

        Args:
            make: creates a new law without memory.
            call: calls the law.
            where: file and line of the law.
        """
        self._make, self._call, self._where = make, call, where
        super().__init__(robot, settings)

    def reset(self, tau_0: Array) -> None:
        """Clears all memory, including a fault; τ₀ (n,) N·m is the torque acting now."""
        super().reset(tau_0)
        self._viewer.forget()
        self._law: Law | None = None
        self._failed = False
        self._share = 1.0

    def configure(self, settings: Settings) -> None:
        """Applies new settings immediately and without a jump of the torque. If they do not fit, it raises
        InputError and changes nothing."""
        before = self._viewer.memory
        self._apply(settings)
        self._viewer.memory = before
        self._share = _FIRST_SHARE

    def _apply(self, settings: Settings) -> None:
        check_solver(settings, False)
        viewer = Viewer(self.robot, settings, prepare(self.robot, settings))
        goal = in_force(self.robot, settings.limits)
        # Everything that may raise is above.
        self._settings, self._viewer, self._goal = settings, viewer, goal
        self._M_bar = read_only(np.array(settings.M_bar))

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """Computes one control period like `HIMPC.step`. Errors of the law raise no exception."""
        started = perf_counter_ns()
        if tau_applied is not None and usable(tau_applied):
            self._tau_0 = np.array(tau_applied, float)
        if not (usable(q) and usable(v)):
            self._viewer.forget()
            return self._resting(q, np.zeros_like(q), {}, {}, started, None)
        self._limits = ramp(self._limits, self._goal, self._tau_0, q, v, self._settings.T_s)
        with np.errstate(all="ignore"):
            now, values, errors = self._viewer.at(q, v, self._tau_0, self._M_bar, self._limits, previews)
        moving = now.q_ddot + REST * now.q_dot
        if self._failed:
            return self._resting(q, moving, errors, values, started, None)
        try:
            if self._law is None:
                self._law = self._make()
            answers = checked(self._call(self._law, now), len(now.levels), now.n, self._where)
        except OwnFault as fault:
            self._failed = True
            return self._resting(q, moving, errors, values, started, str(fault))
        plan = self._plan(q, v, now, self._opened(answers), errors, values, started)
        self._tau_0 = plan.tau
        return plan

    def _opened(self, answers: Array) -> Array:
        """After a change of settings, returns torques that gradually approach the law's."""
        share, T_s = self._share, self._settings.T_s
        if share >= 1.0:
            return answers
        self._share = min(1.0, share * _FIRST_SHARE ** (-T_s / OPENING_SECONDS))
        return self._tau_0 + share * (answers - self._tau_0)

    def _plan(
        self,
        q: Array,
        v: Array,
        now: View,
        answers: Array,
        errors: dict[str, Array],
        values: dict[str, Array],
        started: int,
    ) -> Plan:
        tau_0, limits, M_bar = self._tau_0, self._limits, self._M_bar
        tau = answers[-1]
        step_us = (perf_counter_ns() - started) / 1e3

        def evidence() -> Evidence:
            increments = answers - tau_0
            known = len(answers) == len(now.levels)  # a single torque does not show the demand of each level
            levels = []
            for i, level in enumerate(now.levels):
                U = increments[i] if known else increments[-1]
                cost = next_cost(level, U / M_bar, now.T_s) + float(level.R * U @ U)
                leak = leak_of(now.levels, list(increments / M_bar), i) if known else math.nan
                levels.append(solution(level.name, U, cost, leak))
            after = np.array((q, q + now.T_s * v))
            return Evidence(tuple(levels), after, errors, values, no_rows(len(q)))

        return Plan(tau, tau_0, limits, step_us, 0, evidence)

    def _resting(
        self,
        q: Array,
        moving: Array,
        errors: dict[str, Array],
        values: dict[str, Array],
        started: int,
        notice: str | None,
    ) -> Plan:
        """Returns the plan of a tick without a torque of the law: τ₀ − M̄ · moving, within the torque limits.
        moving: the acceleration that this torque shall cancel, (n,)."""
        limits: LimitsInForce = self._limits
        tau = np.clip(self._tau_0 - self._M_bar * moving, limits.tau_lower, limits.tau_upper)
        status = "the code failed" if self._failed else "state not finite"
        level = solution(self._viewer.first, tau - self._tau_0, math.nan, 0.0, status, "hold")
        evidence = Evidence((level,), np.tile(q, (2, 1)), errors, values, no_rows(len(q)))
        step_us = (perf_counter_ns() - started) / 1e3
        plan = Plan(tau, self._tau_0, limits, step_us, 1, lambda: evidence, notice=notice)
        self._tau_0 = tau
        return plan

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
from himpc.controllers.view import Bounds, LevelView, NearView, View, read_only
from himpc.formulation.forms import StackForm, measure, prepare, usable
from himpc.formulation.settings import Settings, check_solver
from himpc.kinematics.configuration import Configuration
from himpc.limits import LimitsInForce, in_force, ramp, viability_bounds
from himpc.limits.near import Near
from himpc.limits.velocity import reaction
from himpc.plan import Evidence, Plan
from himpc.references import Preview
from himpc.references.hold import still
from himpc.references.outlook import observed_by
from himpc.tasks import Damping
from himpc.tick.distances import Distances
from robots import NominalModel, Robot

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
_NUDGE = 1e-4
"""rad or m: displacement of the joints, forward and backward, for central differences of Jacobians."""


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
        self._elsewhere = robot.model.createData()
        self._make, self._call, self._where = make, call, where
        super().__init__(robot, settings)

    def reset(self, tau_0: Array) -> None:
        """Clears all memory, including a fault; τ₀ (n,) N·m is the torque acting now."""
        super().reset(tau_0)
        self._before: tuple[Array, Array, float] | None = None
        self._x_dot: Array | None = None
        self._law: Law | None = None
        self._failed = False
        self._share = 1.0

    def configure(self, settings: Settings) -> None:
        """Applies new settings immediately and without a jump of the torque. If they do not fit, it raises
        InputError and changes nothing."""
        self._apply(settings)
        self._x_dot = None
        self._share = _FIRST_SHARE

    def _apply(self, settings: Settings) -> None:
        check_solver(settings, False)
        prepared = prepare(self.robot, settings)
        nominal, goal = NominalModel(self.robot, settings.nominal), in_force(self.robot, settings.limits)
        avoidance = settings.limits.avoidance
        distances = Distances(self.robot, avoidance) if avoidance.on else None
        # Everything that may raise is above.
        self._form, self._idle, self._off = prepared
        self._settings, self._nominal, self._goal, self._distances = settings, nominal, goal, distances
        self._M_bar = read_only(np.array(settings.M_bar))

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """Computes one control period like `HIMPC.step`. Errors of the law raise no exception."""
        started = perf_counter_ns()
        if tau_applied is not None and usable(tau_applied):
            self._tau_0 = np.array(tau_applied, float)
        if not (usable(q) and usable(v)):
            self._before = None
            return self._resting(q, np.zeros_like(q), {}, {}, started, None)
        self._limits = ramp(self._limits, self._goal, self._tau_0, q, v, self._settings.T_s)
        values: dict[str, Array] = {}
        errors: dict[str, Array] = {}
        with np.errstate(all="ignore"):
            now = self._view(q, v, previews, values, errors)
        self._before = (np.array(q), np.array(v), self._settings.T_s)
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

    # ---------------------------------------------------------------- the view that the law receives

    def _view(
        self,
        q: Array,
        v: Array,
        previews: Mapping[str, Preview],
        values: dict[str, Array],
        errors: dict[str, Array],
    ) -> View:
        settings, form = self._settings, self._form
        T_s, N = settings.T_s, settings.horizon
        h = _NUDGE / max(1.0, float(np.abs(v).max()))
        here = Configuration(self.robot, self._data, q, v, previews=previews)
        J = form.jacobian(here)[0]
        error = measure(form.tasks, here, previews, values, errors)
        if self._off:
            measure(self._off, here, previews, values, errors)
        q_before, v_before, period = self._before or (q, v, T_s)
        x_dot = J @ v
        if self._x_dot is None:
            past = Configuration(self.robot, self._elsewhere, q_before, v_before, previews=previews)
            self._x_dot = form.jacobian(past)[0] @ v_before
        x_ddot, self._x_dot = (x_dot - self._x_dot) / period, x_dot
        drift = form.drift(self.robot, self._elsewhere, q, v, previews, h)
        displacement, velocity, acceleration = wanted(form, form.asked(here, previews), N)
        levels = []
        for level in () if self._idle else form.levels:
            rows = level.rows
            levels.append(
                LevelView(
                    name=level.name,
                    tasks=tuple(task.name for task in level.level.tasks),
                    x={task.name: read_only(values[task.name]) for task in level.level.tasks},
                    error=read_only(error[rows]),
                    x_dot=read_only(x_dot[rows]),
                    x_ddot=read_only(x_ddot[rows]),
                    J=read_only(J[rows]),
                    J_dot_q_dot=read_only(drift[rows]),
                    displacement_d=read_only(displacement[:, rows]),
                    x_dot_d=read_only(velocity[:, rows]),
                    x_ddot_d=read_only(acceleration[:, rows]),
                    K_p=read_only(form.model.K_p[rows]),
                    K_v=read_only(form.model.K_v[rows]),
                    Q=read_only(level.root_Q**2),
                    R=read_only(level.R),
                    jacobian=lambda at, rows=rows: self._jacobian_at(form, at, previews)[rows],
                )
            )
        return View(
            q=read_only(q),
            q_dot=read_only(v),
            q_ddot=read_only((v - v_before) / period),
            tau_0=read_only(self._tau_0),
            T_s=T_s,
            N=N,
            M_bar=self._M_bar,
            levels=tuple(levels),
            bounds=self._bounds(q),
            near=self._near(q, previews),
            nominal=self._nominal,
        )

    def _jacobian_at(self, form: StackForm, q: Array, previews: Mapping[str, Preview]) -> Array:
        q = np.asarray(q, float).reshape(self.robot.n)
        at = Configuration(self.robot, self._elsewhere, q, np.zeros_like(q), previews=previews)
        return form.jacobian(at)[0]

    def _bounds(self, q: Array) -> Bounds:
        force, limits = self._limits, self._settings.limits
        rate = limits.velocity_approach
        lower, upper = -force.v_limit, force.v_limit
        if limits.position == "viability":
            waits = reaction(limits, self._settings.T_s)
            lower, upper = viability_bounds(q, *force.stops, force.v_limit, force.a_max, waits)
        return Bounds(
            tau_lower=read_only(force.tau_lower),
            tau_upper=read_only(force.tau_upper),
            v_lower=read_only(lower),
            v_upper=read_only(upper),
            q_lower=read_only(force.q_lower),
            q_upper=read_only(force.q_upper),
            approach=rate,
        )

    def _near(self, q: Array, previews: Mapping[str, Preview]) -> NearView:
        avoidance, n = self._settings.limits.avoidance, self.robot.n
        none = np.zeros(0)
        near = Near(none, np.zeros((0, n)), none, none, ())
        if self._distances is not None:
            near = self._distances.at(q, observed_by(previews))
        return NearView(
            names=near.names,
            d=read_only(near.distance),
            gradient=read_only(near.gradient),
            d_safe=read_only(near.share * (avoidance.d_safe + avoidance.margin)),
            moving=read_only(near.moving),
            reaction=avoidance.reaction,
            deceleration=avoidance.deceleration,
        )

    # ---------------------------------------------------------------- the use of the law's torque

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
        level = solution(self._form.levels[0].name, tau - self._tau_0, math.nan, 0.0, status, "hold")
        evidence = Evidence((level,), np.tile(q, (2, 1)), errors, values, no_rows(len(q)))
        step_us = (perf_counter_ns() - started) / 1e3
        plan = Plan(tau, self._tau_0, limits, step_us, 1, lambda: evidence, notice=notice)
        self._tau_0 = tau
        return plan


def wanted(form: StackForm, previews: Mapping[str, Preview], N: int) -> tuple[Array, Array, Array]:
    """Returns x_d(k+j) − x_d(k), ẋ_d and ẍ_d of all rows at k … k+N, (N+1, m) each."""
    found: tuple[list[Array], list[Array], list[Array]] = ([], [], [])
    for task, rows in zip(form.tasks, form.sizes, strict=True):
        preview = still(N, rows) if isinstance(task, Damping) else previews[task.name]
        for column, each in zip(found, preview[1:], strict=True):
            column.append(each)
    displacement, velocity, acceleration = (np.concatenate(column, axis=1) for column in found)
    return displacement, velocity, acceleration

"""The base class of the one-step controllers, which have no horizon and demand an acceleration per level."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from time import perf_counter_ns
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import NO_ROWS, LevelSolution
from himpc.controllers.answers import no_rows
from himpc.controllers.base import TorqueController
from himpc.formulation.forms import LevelForm, StackForm, measure, prepare, usable
from himpc.formulation.settings import Settings, check_solver
from himpc.kinematics.configuration import Configuration
from himpc.limits import TORQUE, LimitsInForce, Rows, in_force, ramp
from himpc.plan import Evidence, Plan
from himpc.references import Preview
from himpc.tasks import OrientationTask
from himpc.tick.configure import is_built_in
from himpc.tick.kinematics import Kinematics

Array = NDArray[np.float64]

BLEND_SECONDS = 0.5
"""s: time over which the effect of a change of settings on the torque is blended in."""

_NUDGE = 1e-4
"""rad or m: displacement of the joints, forward and backward, for central differences of Jacobians."""


class Demand(NamedTuple):
    """The demand of one level at this tick: q̈ with J q̈ = ẍ_d − K_v(ẋ − ẋ_d) − K_p x̃ − J̇q̇, which is (4).

    Attributes:
        form: the level with its weights.
        J: (m, n).
        acceleration: the right-hand side, (m,).
    """

    form: LevelForm
    J: Array
    acceleration: Array

    def residual(self, effect: Array) -> Array:
        """Returns √Q times the error of J q̈, (m,); effect: J q̈, (m,)."""
        return self.form.root_Q * (effect - self.acceleration)


class Law(NamedTuple):
    """The result of a controller's law at one tick.

    Attributes:
        bias: torque for q̈ = 0 in the controller's model, (n,) N·m.
        levels: the solution of each level, with U relative to the bias.
    """

    bias: Array
    levels: list[LevelSolution]


class OneStepController(TorqueController):
    """The common part of OSF, TDEOSF and HQP: state, settings and bumpless changes of settings. Subclasses
    implement the law.

    A change of settings is bumpless: the jump of the torque that would occur is subtracted, and this
    correction fades out over BLEND_SECONDS. After `reset` there is no correction.
    """

    clips: bool = False
    """Whether the torque bounds are imposed; otherwise the plan's torque is the demand of the law."""
    solves: bool = False
    """Whether the law solves QPs, with the solver in `Settings.solver`."""
    incremental: bool = False
    """Whether the bias contains τ₀. If it does, the bias is continuous, and only the rest of the torque can
    jump."""

    def reset(self, tau_0: Array) -> None:
        """Clears its memory; τ₀ (n,) N·m is the torque acting now, and q̈ starts at zero."""
        super().reset(tau_0)
        self._before: tuple[Array, float] | None = None
        self._offset = np.zeros(self.robot.n)
        self._share = 0.0
        self._lead = np.zeros(self.robot.n)
        self._changed = False

    def configure(self, settings: Settings) -> None:
        """Applies new settings immediately and without a jump of the torque. If they do not fit, it raises
        InputError and changes nothing."""
        self._apply(settings)
        self._changed = True

    def _apply(self, settings: Settings) -> None:
        check_solver(settings, self.solves)
        prepared = prepare(self.robot, settings)
        goal = in_force(self.robot, settings.limits)
        known = all(is_built_in(task) for task in (*prepared.form.tasks, *prepared.off))
        kinematics = Kinematics(self.robot, prepared.form, prepared.off) if known else None
        self._adopt(settings)
        # Everything that may raise is above.
        self._form, self._idle, self._off = prepared[:3]
        self._goal, self._kinematics = goal, kinematics
        most = np.maximum(self.robot.tau_limit, self._goal.tau_upper)
        self._reach = most if self.clips else np.full(self.robot.n, np.inf)
        self._boundless = no_rows(self.robot.n)
        orientations = [task for task in self._form.tasks if isinstance(task, OrientationTask)]
        self._about_one_axis = [task.name for task in orientations if len(task.axes) == 1]
        self._settings = settings

    @abstractmethod
    def _adopt(self, settings: Settings) -> None:
        """Prepares the data that the law needs besides the stack. Raises InputError before it changes
        anything."""

    @abstractmethod
    def _law(self, q: Array, v: Array, a: Array, demands: list[Demand]) -> Law:
        """Computes the torque of every level.

        Args:
            q, v: measured state, (n,).
            a: q̈ by backward difference of q̇, (n,).
            demands: the levels, highest priority first; empty if no level is enabled.

        Raises:
            numpy.linalg.LinAlgError: the model cannot be evaluated in this state; the torque is then held.
        """

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """Computes one control period: the torque and its evidence from the measured state; arguments as in
        `HIMPC.step`.

        Returns:
            the plan, whose torque is finite. If the state is not finite, the last torque is held.
        """
        started = perf_counter_ns()
        if tau_applied is not None and usable(tau_applied):
            # A reading beyond a joint's torque bound is wrong, see `HIMPC`.
            self._tau_0 = np.minimum(np.maximum(tau_applied, -self._reach), self._reach)
        if not (usable(q) and usable(v)):
            return self._hold(q, "state not finite", started)
        T_s = self._settings.T_s
        self._limits = ramp(self._limits, self._goal, self._tau_0, q, v, T_s)
        v_before, period = self._before or (v, T_s)
        values: dict[str, Array] = {}
        errors: dict[str, Array] = {}
        with np.errstate(all="ignore"):
            try:
                demands = self._demands(self._form, q, v, previews, values, errors)
                law = self._law(q, v, (v - v_before) / period, [] if self._idle else demands)
                tau, levels = self._blended(law)
            except np.linalg.LinAlgError:
                return self._hold(q, "model or reference not finite", started)
        if not usable(tau):
            return self._hold(q, "torque not finite", started)
        self._before = (v, T_s)
        plan = self._plan(tau, levels, np.array((q, q + T_s * v)), errors, values, started)
        self._tau_0 = tau
        return plan

    def _demands(
        self,
        form: StackForm,
        q: Array,
        v: Array,
        previews: Mapping[str, Preview],
        values: dict[str, Array],
        errors: dict[str, Array],
    ) -> list[Demand]:
        """Returns the demands of a form's levels; writes x and x̃ of every task to `values` and `errors`."""
        h = _NUDGE / max(1.0, float(np.abs(v).max()))
        here = Configuration(self.robot, self._data, q, v, previews=previews)
        # The kernel includes the change of J with q. The Jacobian of an orientation about one axis also
        # changes if its target rotates; the kernel does not include this.
        if self._kinematics is not None and not any(
            previews[name].velocity[0].any() for name in self._about_one_axis
        ):
            J, drift, error, x, x_error = self._kinematics.at(q, v, h, previews)
            values.update(x)
            errors.update(x_error)
        else:
            J, drift = form.jacobian(here)[0], form.drift(self.robot, self._data, q, v, previews, h)
            error = measure(form.tasks, here, previews, values, errors)
            if self._off:
                measure(self._off, here, previews, values, errors)
        previews = form.references_in_task_coordinates(here, previews)
        _, velocity_d, acceleration_d = form.motion(previews, 0)[:, 0]
        model = form.model
        acceleration = acceleration_d - model.K_v * (J @ v - velocity_d) - model.K_p * error - drift
        if not math.isfinite(float(acceleration.sum())):
            raise np.linalg.LinAlgError("the demand is not finite")
        return [Demand(level, J[level.rows], acceleration[level.rows]) for level in form.levels]

    def _blended(self, law: Law) -> tuple[Array, list[LevelSolution]]:
        """Returns the torque, and the levels relative to τ₀. The torque changes gradually after a change of
        settings."""
        lead = law.levels[-1].U[0] if law.levels else np.zeros(self.robot.n)
        if self._changed:
            self._offset = (self._lead if self.incremental else self._tau_0 - law.bias) - lead
            self._share, self._changed = 1.0, False
        base = law.bias + self._share * self._offset
        self._share = max(0.0, self._share - self._settings.T_s / BLEND_SECONDS)
        tau = base + lead
        self._lead = tau - law.bias
        if self.clips:
            tau = np.minimum(np.maximum(tau, self._limits.tau_lower), self._limits.tau_upper)
        return tau, [level._replace(U=level.U + (base - self._tau_0)) for level in law.levels]

    def _hold(self, q: Array, status: str, started: int) -> Plan:
        """Returns the plan for a tick without a usable state or model: the torque is held and the stored
        velocity is cleared."""
        self._before = None
        if self.clips:
            self._tau_0 = np.clip(self._tau_0, self._limits.tau_lower, self._limits.tau_upper)
        still = np.zeros((1, self.robot.n))
        name = self._form.levels[0].level.name
        held = LevelSolution(name, still, math.nan, NO_ROWS, 0.0, status, "hold", 0.0, 0.0, 0.0)
        return self._plan(self._tau_0, [held], np.tile(q, (2, 1)), {}, {}, started)

    def _plan(
        self,
        tau: Array,
        levels: list[LevelSolution],
        q: Array,
        errors: dict[str, Array],
        values: dict[str, Array],
        started: int,
    ) -> Plan:
        rows = self._rows(self._limits, self._tau_0) if self.clips else self._boundless
        evidence = Evidence(tuple(levels), q, errors, values, rows)
        return Plan(
            tau=tau,
            tau_0=self._tau_0,
            limits=self._limits,
            step_us=(perf_counter_ns() - started) / 1e3,
            unsolved=sum(level.fallback != "solve" for level in levels),
            find_evidence=lambda: evidence,
        )

    def _rows(self, limits: LimitsInForce, origin: Array) -> Rows:
        """Returns the bounds of this tick on torques relative to `origin`."""
        lower, upper = limits.tau_lower - origin, limits.tau_upper - origin
        return Rows(np.ones((1, 1)), lower[None], upper[None], (TORQUE,))


class WithJacobian(Protocol):
    """A level at one tick."""

    @property
    def J(self) -> Array:
        """(m, n)."""
        ...


def leak(demands: Sequence[WithJacobian], accelerations: list[Array], level: int) -> float:
    """Returns the largest ‖J_p (q̈_i − q̈_p)‖∞ over all levels p above level i.

    accelerations: q̈_p (n,) that the levels down to each p cause in the model.
    """
    moved = (demands[p].J @ (accelerations[level] - accelerations[p]) for p in range(level))
    return max((float(np.abs(change).max()) for change in moved), default=0.0)

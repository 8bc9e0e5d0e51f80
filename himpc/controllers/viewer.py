"""Prepares the `View` of every tick, for a user's own controller and for HIMPC on one page."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from himpc.controllers.view import Bounds, Further, LevelView, NearView, View, read_only
from himpc.formulation.forms import Prepared, StackForm, measure
from himpc.formulation.memory import Memory
from himpc.formulation.settings import Settings
from himpc.kinematics.configuration import Configuration
from himpc.limits import POSITION, TORQUE, VELOCITY, LimitsInForce, viability_bounds
from himpc.limits.constraint import Moment, Near
from himpc.limits.constraints import imposed
from himpc.limits.velocity import reaction
from himpc.prediction import JointState
from himpc.references import Preview
from himpc.references.outlook import observed_by
from himpc.tick.distances import Distances
from robots import NominalModel, Robot

Array = NDArray[np.float64]

_NUDGE = 1e-4
"""rad or m: displacement of the joints, forward and backward, for central differences of Jacobians."""


class Viewer:
    """The data of one controller with one set of settings from which its views follow.

    Attributes:
        memory: the state of the last tick and ẋ at that state; None before the first tick.
        distances: the pairs whose distances are kept; None if none are.
        now: the `Moment` of the last view.
    """

    def __init__(self, robot: Robot, settings: Settings, prepared: Prepared) -> None:
        """Raises InputError if the settings do not fit the robot."""
        self._robot, self._settings = robot, settings
        self._data, self._elsewhere = robot.model.createData(), robot.model.createData()
        self.form, self._idle, self._off = prepared[:3]
        self._nominal = NominalModel(robot, settings.nominal)
        avoidance = settings.limits.avoidance
        self.distances = Distances(robot, avoidance) if avoidance.on else None
        self.memory: Memory | None = None
        self._along: tuple[Array, Array] | None = None

    def change(self, settings: Settings, form: StackForm) -> None:
        """Takes the numbers of settings of the same structure, see `same_structure`."""
        self._settings, self.form = settings, form
        if self.distances is not None:
            self.distances.change(settings.limits.avoidance)

    @property
    def first(self) -> str:
        """The name of the first level."""
        return self.form.levels[0].name

    def forget(self) -> None:
        """Clears the memory."""
        self.memory = None

    def at(
        self,
        q: Array,
        v: Array,
        tau_0: Array,
        M_bar: Array,
        force: LimitsInForce,
        previews: Mapping[str, Preview],
        path: Array | None = None,
    ) -> tuple[View, dict[str, Array], dict[str, Array]]:
        """Returns the view of a tick, and x and x̃ of every task by its name. The tick becomes the memory of
        the next tick.

        Args:
            q, v: measured state, (n,), finite.
            tau_0: torque that acts, (n,) N·m.
            M_bar: diagonal of M̄, (n,) kg·m².
            force: the limits in force.
            previews: the previews of all tasks.
            path: q̂ at knots 0 … N−1, (N, n), along which references in the coordinates of a task are taken;
                None: at the measured q.
        """
        settings, form, robot = self._settings, self.form, self._robot
        T_s, N = settings.T_s, settings.horizon
        values: dict[str, Array] = {}
        errors: dict[str, Array] = {}
        h = _NUDGE / max(1.0, float(np.abs(v).max()))
        here = Configuration(robot, self._data, q, v, previews=previews)
        if path is not None:
            here = Configuration(robot, self._data, q, v, path[1:], previews)
        J = form.jacobian(here)[0]
        error = measure(form.tasks, here, previews, values, errors)
        if self._off:
            measure(self._off, here, previews, values, errors)
        memory = self.memory or Memory(q, v, T_s)
        x_dot, before = J @ v, memory.x_dot
        if before is None or memory.form is not form:
            past = Configuration(robot, self._elsewhere, memory.q, memory.v, previews=previews)
            before = form.jacobian(past)[0] @ memory.v
        x_ddot = (x_dot - before) / memory.period
        drift = form.drift(robot, self._elsewhere, q, v, previews, h)
        ahead = form.references_in_task_coordinates(here, previews)
        displacement, velocity, acceleration = form.motion(ahead, N)
        levels = [
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
                horizon=level.knots,
                jacobian=lambda at, rows=rows: self._jacobian(at, v, previews)[..., rows, :],
            )
            for level in (() if self._idle else form.levels)
            for rows in (level.rows,)
        ]
        near = self.distances and self.distances.at(q, observed_by(previews))
        state = JointState(q, v, (v - memory.v) / memory.period)
        self.now = Moment(state, tau_0, M_bar, settings.limits, force, N, T_s, near)
        self.memory = Memory(np.array(q), np.array(v), T_s, x_dot, form)
        self._along = None
        view = View(
            q=read_only(q),
            q_dot=read_only(v),
            q_ddot=read_only(state.a),
            tau_0=read_only(tau_0),
            T_s=T_s,
            N=N,
            M_bar=read_only(M_bar),
            levels=tuple(levels),
            bounds=self._bounds(q, force),
            near=self._near(near),
            further=self._further(),
            nominal=self._nominal,
        )
        return view, values, errors

    def _jacobian(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> Array:
        """Returns J of all rows at a configuration, or at the configurations of all knots."""
        q, n = np.asarray(q, float), self._robot.n
        if q.ndim < 2 or q.shape[1] != n:
            q = q.reshape(n)
            at = Configuration(self._robot, self._elsewhere, q, np.zeros_like(q), previews=previews)
            return self.form.jacobian(at)[0]
        if self._along is None or not np.array_equal(
            self._along[0], q
        ):  # every level asks for the same knots
            at = Configuration(self._robot, self._elsewhere, q[0], v, q[1:], previews)
            self._along = q.copy(), self.form.jacobian(at)
        return self._along[1]

    def _bounds(self, q: Array, force: LimitsInForce) -> Bounds:
        limits = self._settings.limits
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
            approach=limits.velocity_approach,
            paper=limits.position == "paper",
        )

    def _near(self, near: Near | None) -> NearView:
        avoidance, none = self._settings.limits.avoidance, np.zeros(0)
        near = near or Near(none, np.zeros((0, self._robot.n)), none, none, ())
        return NearView(
            names=near.names,
            d=read_only(near.distance),
            gradient=read_only(near.gradient),
            d_safe=read_only(near.share * (avoidance.d_safe + avoidance.margin)),
            moving=read_only(near.moving),
            reaction=avoidance.reaction,
            deceleration=avoidance.deceleration,
        )

    def _further(self) -> tuple[Further, ...]:
        further = []
        for constraint in imposed(self._settings.limits):
            if constraint not in (TORQUE, VELOCITY, POSITION):
                block = constraint.bounds(self.now)
                D = np.eye(self._robot.n) if block.directions is None else block.directions.D
                further.append(Further(constraint.profile(self.now.N), D, block.lower, block.upper))
        return tuple(further)

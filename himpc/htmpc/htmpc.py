"""HTMPC: hierarchical-task MPC, section IV of the paper, and its variants with a single task or without a
preview."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from itertools import accumulate
from time import perf_counter_ns

import numpy as np

from himpc.htmpc.active_set import ActiveSetSolver
from himpc.htmpc.clearance import Avoidance, CollisionModel, clearance
from himpc.htmpc.cost import Effort
from himpc.htmpc.kernel.kinds import COLLISION, LEXICOGRAPHIC
from himpc.htmpc.kinematics import Knots, desired_values
from himpc.htmpc.plan import ActiveMotionRows, LevelEvidence, VelocityPlan
from himpc.htmpc.prediction import Motion, Start, braking, positions, shifted, underway, velocities
from himpc.htmpc.problem import Iterate, Problem, SharedStep
from himpc.htmpc.rows import ConstraintRows, ConstraintTable, held, limit_rows
from himpc.htmpc.safety import commandable, permitted, plausible
from himpc.htmpc.settings import HTMPCSettings, bounds, efforts
from himpc.htmpc.sqp import Solved, solve_level
from himpc.htmpc.tracking import Guard, Tracking, check_dimensions, tracking
from himpc.kinematics.configuration import Configuration, joint_indices
from himpc.references import Preview
from himpc.references.curves import still
from himpc.stack import Stack
from robots import Robot
from robots.arrays import Array, Integers

_MEMORY = 200
"""Number of stored plans; it suffices for a delay of 1 s at 200 Hz."""


class HTMPC:
    """Plans velocities by Algorithm 2: one STMPC (9) per level, from the highest priority down.

    The controller uses geometry and limits of the robot. Call `step` once per control period. The controller
    stores its last plans only. `configure` changes settings and keeps these plans, so the commanded motion
    continues without a jump.
    """

    def __init__(self, robot: Robot, settings: HTMPCSettings) -> None:
        """Raises InputError if the settings do not fit the robot."""
        self.robot = robot
        self._data = robot.model.createData()
        self._method = ActiveSetSolver()
        self.configure(settings)
        self.reset()

    @property
    def settings(self) -> HTMPCSettings:
        """The settings in use."""
        return self._settings

    def reset(self) -> None:
        """Clears the plan; the robot is assumed to continue at the measured velocity without acceleration."""
        self._past: deque[Motion] = deque(maxlen=_MEMORY)
        self._since = self._settings.period

    def configure(self, settings: HTMPCSettings) -> None:
        """Applies new settings immediately and without a jump of the command. If the settings do not fit, the
        method raises InputError and changes nothing."""
        robot = self.robot
        home = Configuration(robot, self._data, robot.home, robot.home)
        tasks = tuple(task for level in settings.stack for task in level.tasks)
        for task in tasks:
            task.jacobian(home)
        # Disabled levels are prepared too, so that a wrong weight is refused now and not when the level is
        # enabled.
        every = [(level, tracking(robot, level, settings)) for level in settings.stack]
        active = self._chosen(tuple(level for level in settings.stack if level.enabled))
        check_dimensions(robot, active)
        weights, limits = efforts(robot, settings), bounds(robot, settings.limits)
        collision = CollisionModel(robot, settings.obstacles, settings.self_collision)
        hold, levels = self._held(active, settings), tuple(form for level, form in every if level in active)
        guards = [*accumulate((form.guards(settings) for form in levels), initial=())]
        effort = Effort(weights, settings.horizon, settings.dt)
        avoidance = None if collision.empty else Avoidance(collision, settings.margin_m)
        # Everything that may raise is above.
        self._hold, self._levels = hold, levels
        self._guards = guards[:-1]  # each level has the rows of all levels above it
        self._bounds, self._effort, self._avoidance = limits, effort, avoidance
        self._table = ConstraintTable(settings.horizon * robot.n)
        self._tasks = tasks
        self._settings = settings

    def _chosen(self, enabled: Stack) -> Stack:
        """Returns the enabled levels that are solved."""
        return enabled

    def _held(self, chosen: Stack, settings: HTMPCSettings) -> Integers:
        """Returns the columns of the joints that stay at rest."""
        return np.array(joint_indices(self.robot, settings.hold) if settings.hold else [], np.int64)

    def step(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> VelocityPlan:
        """Plans one control period: computes the motion and its evidence from the measured state.

        Args:
            q, v: measured joint positions and velocities, (n,).
            previews: the reference of every task by its name, at knots 0 … N at distances Δt (N + 1
                samples), as `himpc.references.previews` returns them. Knot 0 is the time of this tick plus
                `delay_s`.

        Returns:
            the plan. It is finite and inside the bounds for every state. A measured state that is not
            plausible is replaced by the prediction of the last plan.
        """
        started = perf_counter_ns()
        tick = self._tick(self._start(q, v), previews)
        with np.errstate(all="ignore"):
            solved = self._solve(tick)
        at = solved[-1].at if solved else tick.iterate(tick.brake)
        named = None if self._avoidance is None else self._avoidance.model.named
        levels = tuple(
            evidence(level, one, at, guards, named)
            for level, one, guards in zip(self._levels, solved, self._guards, strict=True)
        )
        U = at.U if np.isfinite(at.U).all() else tick.brake
        U = permitted(tick.start, U, self._bounds, self._settings.period)
        motion = Motion(tick.start, U, self._settings.dt)
        self._past.append(motion)
        self._since = self._settings.period
        return self._decided(tick, motion, levels, clearance(at.distances), started)

    def _start(self, q: Array, v: Array) -> Start:
        """Returns the initial state of the plan, predicted forward by the delay, and the input before that
        state."""
        # The robot has followed the last plan for one period of the previous control rate, which may differ
        # from the present rate.
        period, past, still = self._since, self._past, np.zeros(self.robot.n)
        usable = plausible(self.robot, q, v)
        if not past and not usable:
            return Start(self.robot.home, still, still)
        if not past:
            return Start(np.array(q, float), commandable(v, None, self._bounds), still)
        last = past[-1].velocity(period)
        acted = (last - past[-1].start.v) / period
        if not usable:
            return Start(past[-1].position(period), last, acted)
        delay = self._settings.delay_s
        if delay == 0.0:
            return Start(np.array(q, float), commandable(v, last, self._bounds), acted)
        # Commands that were sent but do not act yet can no longer be changed.
        return Start(q + underway(past, period, delay), last, acted)

    def _tick(self, start: Start, previews: Mapping[str, Preview]) -> SharedStep:
        settings, limits = self._settings, self._bounds
        N, dt, period = settings.horizon, settings.dt, settings.period
        past, hold = self._past, self._hold
        rows = limit_rows(start, N, dt, period, limits, self._table)
        plan = (
            shifted(past[-1], self._since, N, dt, limits) if past else braking(start, N, dt, period, limits)
        )
        if hold.size:
            brake = braking(start, N, dt, period, limits)
            plan[:, hold] = brake[:, hold]
            rows = held(rows, brake, hold, self._table)
        return SharedStep(
            robot=self.robot,
            data=self._data,
            settings=settings,
            start=start,
            desired={task.name: desired_values(task, previews[task.name], N) for task in self._tasks},
            effort=self._effort,
            rows=rows,
            bounds=limits,
            plan=plan,
            avoidance=self._avoidance,
            method=self._method,
            table=self._table,
        )

    def _solve(self, tick: SharedStep) -> list[Solved]:
        """Solves all levels by Algorithm 2."""
        at = tick.iterate(tick.plan)
        solved: list[Solved] = []
        guards: list[Guard] = []
        for level in self._levels:
            last = level is self._levels[-1]
            absolute = last or self._settings.formulation == "paper"
            solution = solve_level(Problem(tick, level, tuple(guards), absolute), at)
            at = solution.at
            guards.append(Guard(level, at.errors(level)))
            solved.append(solution)
        return solved

    def _decided(
        self, tick: SharedStep, motion: Motion, levels: tuple[LevelEvidence, ...], ahead: float, started: int
    ) -> VelocityPlan:
        settings, start, U = self._settings, tick.start, motion.U
        q = np.vstack([start.q, positions(start, U, settings.dt)])
        now = Knots(self.robot, self._data, q[:1])
        values = {task.name: now.value(task) for task in self._tasks}
        errors = {
            task.name: task.error(values[task.name], tick.desired[task.name][0]) for task in self._tasks
        }
        here = None if self._avoidance is None else self._avoidance.near(now.joints, gradients=False)
        return VelocityPlan(
            command=motion.velocity(settings.period),
            motion=motion,
            q=q,
            v=np.vstack([start.v, velocities(start, U, settings.dt)]),
            u=U,
            levels=levels,
            errors=errors,
            values=values,
            bounds=self._bounds,
            clearance=min(ahead, clearance(here)),
            step_us=(perf_counter_ns() - started) / 1e3,
        )


_ROUNDING = 1e-6
"""A multiplier whose magnitude is smaller than this is a rounding error."""


def evidence(
    level: Tracking,
    solved: Solved,
    final: Iterate,
    guards: Sequence[str],
    named: Callable[[int], str] | None = None,
) -> LevelEvidence:
    """Builds the evidence of a level from the result of `solve_level`.

    Args:
        final: the inputs after all levels.
        guards: the names of the rows of (12) or (11), in their order.
        named: returns the names of a pair, see `CollisionModel.named`.
    """
    best = solved.at.errors(level)
    return LevelEvidence(
        name=level.name,
        status=solved.status,
        fallback=solved.fallback,
        kkt_residual=solved.kkt_residual,
        best=best,
        final=final.errors(level),
        cost=level.cost(best),
        steps=solved.steps,
        iterations=len(solved.steps),
        unsolved=solved.unsolved,
        time_us=solved.time_us,
        active=_active_rows(solved.rows, solved.multipliers, guards, named),
    )


def _active_rows(
    rows: ConstraintRows, multipliers: Array, guards: Sequence[str], named: Callable[[int], str] | None
) -> ActiveMotionRows:
    """Returns the active rows. The bounds of the slacks, whose multipliers are the last ones, are left
    out."""
    multipliers = multipliers[: len(rows.kind)]
    some = np.flatnonzero(np.abs(multipliers) > _ROUNDING)
    kind, part = rows.kind[some], rows.part[some]
    of_guards = dict(zip(np.flatnonzero(rows.kind == LEXICOGRAPHIC).tolist(), guards, strict=True))
    names = tuple(
        named(pair) if is_pair and named else of_guards.get(row, "")
        for row, is_pair, pair in zip(some.tolist(), (kind == COLLISION).tolist(), part.tolist(), strict=True)
    )
    return ActiveMotionRows(kind, rows.knot[some], part, multipliers[some], names)


class STMPC(HTMPC):
    """Single-task MPC: (9) for the first enabled level of the stack. All other levels are ignored."""

    def _chosen(self, enabled: Stack) -> Stack:
        return enabled[:1]


class HTMPC_WPT(HTMPC):
    """HTMPC without a preview (section V-C): every reference is a waypoint, constant at its present value."""

    def step(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> VelocityPlan:
        return super().step(q, v, {name: _frozen(preview) for name, preview in previews.items()})


def _frozen(preview: Preview) -> Preview:
    knots, m = preview.displacement.shape
    rest = still(knots - 1, m)
    return Preview(preview.value, rest.displacement, rest.velocity, rest.acceleration)

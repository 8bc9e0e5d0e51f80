"""HTIDKC: hierarchical-task inverse differential kinematic control, with which the paper compares HTMPC."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.kernel.kinds import VELOCITY
from himpc.htmpc.plan import Felt, LevelEvidence, VelocityPlan
from himpc.htmpc.prediction import Motion, Start
from himpc.htmpc.safety import commandable, plausible
from himpc.htmpc.settings import HTMPCSettings, MotionBounds, bounds
from himpc.htmpc.tracking import check_dimensions
from himpc.kinematics.configuration import Configuration
from himpc.qp import QPSolution, solve_qp
from himpc.references import Preview
from himpc.stack import Level
from himpc.tasks import Task
from robots import Robot

Array = NDArray[np.float64]


class _Box(NamedTuple):
    lower: Array
    upper: Array


class HTIDKC:
    """Computes one velocity per period by a cascade of regularised QPs. It uses these settings: the stack,
    `gains`, `rho`, the solver, the rate, and the limits without the jerk limit (section V-C). The authors use
    a rate of 50 Hz.

    Level 0 minimises the violation of the bounds. The bounds form a box, one interval per joint, so its
    solution is the nearest point of the box that the accelerations allow. Level l then solves min ½‖J_l q̇ −
    ẋ_l‖² + ½ρ‖q̇‖² inside the intervals of level 0, with J_i q̇ = J_i q̇*_i for the levels i above.
    """

    def __init__(self, robot: Robot, settings: HTMPCSettings) -> None:
        """Raises InputError if the settings do not fit the robot."""
        self.robot = robot
        self._data = robot.model.createData()
        self.configure(settings)
        self.reset()

    @property
    def settings(self) -> HTMPCSettings:
        """The settings in use."""
        return self._settings

    def reset(self) -> None:
        """Clears the last command."""
        self._last: Array | None = None

    def configure(self, settings: HTMPCSettings) -> None:
        """Applies new settings immediately; the last command is kept. If the settings do not fit, the method
        raises InputError and changes nothing."""
        home = Configuration(self.robot, self._data, self.robot.home, self.robot.home)
        for level in settings.stack:
            for task in level.tasks:
                task.jacobian(home)
        levels = tuple(level for level in settings.stack if level.enabled)
        check_dimensions(self.robot, levels)
        self._bounds = bounds(self.robot, settings.limits)
        self._levels = levels
        self._settings = settings

    def step(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> VelocityPlan:
        """Computes the command of one control period; only the first knot of each preview is used.

        Args:
            q, v: measured joint positions and velocities, (n,).
            previews: the reference of every task by its name.

        Returns:
            the plan with one knot. It is finite and inside the bounds for every state. If the state is not
            plausible, the command decreases to zero.
        """
        started = perf_counter_ns()
        settings, period = self._settings, self._settings.period
        usable = plausible(self.robot, q, v)
        q = np.array(q, float) if usable else self.robot.home
        last = self._last
        if last is None:
            last = commandable(v, None, self._bounds) if usable else np.zeros(self.robot.n)
        here = Configuration(self.robot, self._data, q, last, previews=previews)
        box = self._level_zero(q, last)
        command = np.clip(np.zeros(self.robot.n), box.lower, box.upper)
        above: list[tuple[Array, Array]] = []
        levels: list[LevelEvidence] = []
        for index, level in enumerate(self._levels if usable else ()):
            gain = settings.gains[min(index, len(settings.gains) - 1)]
            J = np.vstack([task.jacobian(here)[0] for task in level.tasks])
            goal = np.concatenate([self._wanted(task, here, previews, gain) for task in level.tasks])
            begun = perf_counter_ns()
            solution = self._solve(J, goal, box, above)
            if solution.solved:
                command = np.clip(solution.x, box.lower, box.upper)
            above.append((J, J @ command))
            levels.append(self._evidence(level, J @ command - goal, solution, begun))
        start = Start(q, last, np.zeros(self.robot.n))
        motion = Motion(start, ((command - last) / period)[None], period)
        self._last = command
        tasks = [task for level in settings.stack for task in level.tasks]
        values = {task.name: task.value(here) for task in tasks}
        return VelocityPlan(
            command=command,
            motion=motion,
            q=np.vstack([q, motion.position(period)]),
            v=np.vstack([last, command]),
            u=motion.U,
            levels=tuple(levels),
            errors={task.name: task.error(values[task.name], previews[task.name].value) for task in tasks},
            values=values,
            bounds=self._bounds,
            clearance=np.inf,
            step_us=(perf_counter_ns() - started) / 1e3,
        )

    def _wanted(self, task: Task, here: Configuration, previews: Mapping[str, Preview], gain: float) -> Array:
        preview = previews[task.name]
        return task.asked(here, preview).velocity[0] - gain * task.error(task.value(here), preview.value)

    def _level_zero(self, q: Array, last: Array) -> _Box:
        """Returns the box of reachable velocities inside all bounds in this period. If a joint has no such
        velocity, its interval contains only the reachable velocity that is nearest to the bounds."""
        limits, T = self._bounds, self._settings.period
        reach = _Box(last - limits.a * T, last + limits.a * T)
        upper = np.minimum(limits.v, _approach(limits.q_upper - q, limits, T))
        lower = np.maximum(-limits.v, -_approach(q - limits.q_lower, limits, T))
        return _Box(np.clip(lower, reach.lower, reach.upper), np.clip(upper, reach.lower, reach.upper))

    def _solve(self, J: Array, goal: Array, box: _Box, above: list[tuple[Array, Array]]) -> QPSolution:
        n = self.robot.n
        A = np.vstack([np.eye(n), *(rows for rows, _ in above)])
        fixed = [value for _, value in above]
        return solve_qp(
            J.T @ J + self._settings.rho * np.eye(n),
            -J.T @ goal,
            A,
            np.concatenate([box.lower, *fixed]),
            np.concatenate([box.upper, *fixed]),
            self._settings.solver,
        )

    def _evidence(self, level: Level, gap: Array, solution: QPSolution, begun: int) -> LevelEvidence:
        multipliers = solution.multipliers[: self.robot.n]
        part = np.flatnonzero(np.abs(multipliers) > 1e-6)
        felt = Felt(
            np.full(len(part), VELOCITY),
            np.ones(len(part), np.int64),
            part,
            multipliers[part],
            ("",) * len(part),
        )
        return LevelEvidence(
            name=level.name,
            status=solution.status,
            fallback="solve" if solution.solved else "keep",
            kkt_residual=solution.kkt_residual if solution.solved else 0.0,
            best=gap[None],
            final=gap[None],
            cost=0.5 * float(gap @ gap),
            steps=(1.0 if solution.solved else 0.0,),
            iterations=1,
            unsolved=int(not solution.solved),
            time_us=(perf_counter_ns() - begun) / 1e3,
            felt=felt,
        )


def _approach(room: Array, limits: MotionBounds, T: float) -> Array:
    """Returns the largest velocity from which a joint can still stop within `room`, with one command every T
    seconds. For a joint beyond its bound, returns minus the speed at which the joint moves back, at most a
    fifth of the speed limit."""
    braking = np.where(np.isfinite(limits.a), limits.a, 1e9)
    inside = braking * (np.sqrt(T * T + 2.0 * np.maximum(room, 0.0) / braking) - T)
    return np.where(room >= 0.0, inside, np.maximum(room, -0.2 * limits.v))

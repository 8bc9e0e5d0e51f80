"""The levels prepared for one set of settings: all data that are constant from tick to tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from himpc.cascade.level import LevelProblem
from himpc.constants import TURN_PULL
from himpc.formulation.settings import Settings
from himpc.kinematics.configuration import Configuration
from himpc.prediction import ResidualModel, residual_model
from himpc.references import Later, Preview
from himpc.references.curves import still
from himpc.stack import DAMPING_LEVEL, Level, freedom_left
from himpc.tasks import Damping, FramePosition, Task
from robots import InputError, Robot

Array = NDArray[np.float64]

_TINY = 1e-300


@dataclass(frozen=True, slots=True, eq=False)
class LevelForm:
    """A level with its coefficients.

    Attributes:
        level: the level.
        name: its identity.
        rows: its rows among the rows of all levels.
        C: (N, m, N), effect coefficients.
        root_Q: (m,), √Q.
        R: (n,), in the weight's unit.
        knots: the level's own horizon K ≤ N.
        sizes: number of rows of each of its tasks.
    """

    level: Level
    name: str
    rows: slice
    C: Array
    root_Q: Array
    R: Array
    knots: int
    sizes: tuple[int, ...]

    def problem(self, B: Array, free: Array, share: float | Array = 1.0) -> LevelProblem:
        """Returns the level's QP data. share: factor on its √Q while it fades in, one number or one per
        row."""
        rows = self.rows
        return LevelProblem(
            self.name, B[:, rows], self.C, free[:, rows], share * self.root_Q, self.R, self.knots
        )


@dataclass(frozen=True, slots=True, eq=False)
class StackForm:
    """All active levels, their rows stacked so that kinematics and free motion are evaluated once.

    Attributes:
        levels: highest priority first.
        tasks: their tasks in the order of the rows.
        sizes: number of rows of each task.
        model: coefficients of the residual for all rows.
    """

    levels: tuple[LevelForm, ...]
    tasks: tuple[Task, ...]
    sizes: tuple[int, ...]
    model: ResidualModel

    def jacobian(self, configuration: Configuration) -> Array:
        """Returns Ĵ of all rows at every knot, (N, m, n)."""
        blocks = [task.jacobian(configuration) for task in self.tasks]
        return blocks[0] if len(blocks) == 1 else np.concatenate(blocks, axis=1)

    def drift(
        self, robot: Robot, data: pin.Data, q: Array, v: Array, previews: Mapping[str, Preview], h: float
    ) -> Array:
        """Returns J̇ q̇ of all rows, (m,), from the change of J along the motion of the robot and of the
        targets.

        Args:
            robot, data, q, v, previews: as for a `Configuration`.
            h: s, time by which robot and targets are moved forward and backward for the difference.
        """
        on, back = (
            self.jacobian(Configuration(robot, data, q + s * v, v, previews=Later(previews, s)))[0]
            for s in (h, -h)
        )
        return (on - back) @ v / (2 * h)

    def references_in_task_coordinates(
        self, configuration: Configuration, previews: Mapping[str, Preview]
    ) -> Mapping[str, Preview]:
        """As `Task.reference_in_task_coordinates`, for all tasks."""
        changed = {}
        for task in self.tasks:
            own = type(task).reference_in_task_coordinates
            if own is not Task.reference_in_task_coordinates and task.name in previews:
                preview = previews[task.name]
                reference = task.reference_in_task_coordinates(configuration, preview)
                if reference is not preview:
                    changed[task.name] = reference
        return {**previews, **changed} if changed else previews

    def lengths(self, errors: Mapping[str, Array]) -> Array:
        """Returns the length of each task's error, m or rad."""
        return np.array([float(np.linalg.norm(errors[task.name])) for task in self.tasks])

    def fastest(self, previews: Mapping[str, Preview]) -> float:
        """Returns the largest velocity of a coordinate of the references, m/s or rad/s."""
        led = (task for task in self.tasks if not isinstance(task, Damping))
        return max((float(np.abs(previews[task.name].velocity[0]).max()) for task in led), default=0.0)

    def pulling(self, error: Array, pull: float) -> Array:
        """Returns x̃ on which the tasks act, (m,): an error beyond its limit is shortened, see
        `Avoidance.pull`."""
        parts = np.split(error, np.cumsum(self.sizes)[:-1])
        most = [pull if isinstance(task, FramePosition) else TURN_PULL * pull for task in self.tasks]
        lengths = [max(float(np.linalg.norm(part)), _TINY) for part in parts]
        return np.concatenate(
            [min(1.0, a / b) * part for part, a, b in zip(parts, most, lengths, strict=True)]
        )

    def motion(self, previews: Mapping[str, Preview], N: int) -> Array:
        """Returns x_d(k+j) − x_d(k), ẋ_d and ẍ_d of all rows at k … k+N, (3, N+1, m)."""
        parts = [
            still(N, rows) if isinstance(task, Damping) else previews[task.name]
            for task, rows in zip(self.tasks, self.sizes, strict=True)
        ]
        columns = zip(*(part[1:] for part in parts), strict=True)
        return np.array([np.hstack([samples[: N + 1] for samples in column]) for column in columns])


def measure(
    tasks: Sequence[Task],
    configuration: Configuration,
    previews: Mapping[str, Preview],
    values: dict[str, Array],
    errors: dict[str, Array],
) -> Array:
    """Returns x̃ of tasks, (m,); writes x and x̃ of each task to `values` and `errors`."""
    parts = []
    for task in tasks:
        value = task.value(configuration)
        error = (
            np.zeros_like(value)
            if isinstance(task, Damping)
            else task.error(value, previews[task.name].value)
        )
        values[task.name], errors[task.name] = value, error
        parts.append(error)
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


Counts = Sequence[tuple[int, ...]]
"""The number of rows of each task of each level."""


def _counts(robot: Robot, levels: Sequence[Level]) -> Counts:
    home = Configuration(robot, robot.model.createData(), robot.home, np.zeros(robot.n))
    return [tuple(task.jacobian(home).shape[1] for task in level.tasks) for level in levels]


def stack_form(
    robot: Robot, levels: Sequence[Level], settings: Settings, counts: Counts | None = None
) -> StackForm:
    """Prepares the levels. counts: their numbers of rows, if these are known.

    Raises:
        InputError: a frame or joint is unknown, or a gain or weight has the wrong length.
    """
    N, counts = settings.horizon, _counts(robot, levels) if counts is None else counts
    tasks = tuple(task for level in levels for task in level.tasks)
    sizes = tuple(size for own in counts for size in own)
    K_p, K_v = (
        np.concatenate(
            [
                _spread(getattr(task, name), m, f"{name} of task '{task.name}'")
                for task, m in zip(tasks, sizes, strict=True)
            ]
        )
        for name in ("K_p", "K_v")
    )
    model = residual_model(K_p, K_v, N, settings.T_s)
    forms: list[LevelForm] = []
    for level, own in zip(levels, counts, strict=True):
        start = forms[-1].rows.stop if forms else 0
        rows = slice(start, start + sum(own))
        R = _spread(level.R, len(settings.M_bar), f"R of level '{level.name}'")
        if settings.R_on == "acceleration":
            R = R / np.array(settings.M_bar) ** 2
        root_Q = np.sqrt(_spread(level.Q, sum(own), f"Q of level '{level.name}'"))
        K = min(level.horizon or N, N)
        forms.append(LevelForm(level, level.name, rows, model.C[:, rows], root_Q, R, K, own))
    return StackForm(tuple(forms), tasks, sizes, model)


class Prepared(NamedTuple):
    """The settings of a controller, applied to a robot.

    Attributes:
        form: the levels to solve; the damping level if no other level is to be solved.
        idle: whether no level is enabled and damping is off; the torque is then held.
        off: tasks of the levels that are not solved.
        counts: numbers of rows of all levels of the stack and of the damping level.
        damped: whether the damping level is added.
    """

    form: StackForm
    idle: bool
    off: list[Task]
    counts: Counts
    damped: bool


def prepare(robot: Robot, settings: Settings, before: Prepared | None = None) -> Prepared:
    """Prepares the levels to solve. before: the result for settings of the same structure, see
    `same_structure`; then only numbers are computed.

    Raises:
        InputError: M̄ has the wrong length, a frame or joint is unknown, or a gain or weight does not fit.
    """
    n, every = robot.n, (*settings.stack, DAMPING_LEVEL)
    if len(settings.M_bar) != n:
        raise InputError(f"M_bar has {len(settings.M_bar)} entries: '{robot.name}' has {n} joints")
    counts = _counts(robot, every) if before is None else before.counts
    damped = before.damped if before else settings.damping and freedom_left(robot, settings.stack) > 0

    def form(levels: Sequence[int]) -> StackForm:
        return stack_form(robot, [every[k] for k in levels], settings, [counts[k] for k in levels])

    solved = [k for k, level in enumerate(every if damped else settings.stack) if level.enabled]
    off = [k for k, level in enumerate(settings.stack) if not level.enabled]
    # Disabled levels are prepared too, so that a wrong gain is refused now and not when the level is enabled.
    tasks = list(form(off).tasks) if off else []
    return Prepared(form(solved or [len(every) - 1]), not solved, tasks, counts, damped)


def usable(x: Array) -> bool:
    """Returns whether values are finite, and small enough that their squares and the differences of bounds
    are also finite."""
    return x.dot(x) < 1e18


def _spread(value: float | tuple[float, ...], size: int, what: str) -> Array:
    values = np.atleast_1d(np.asarray(value, float))
    if values.size not in (1, size):
        raise InputError(f"{what} has {values.size} entries: give one number or {size}")
    return np.array(np.broadcast_to(values, (size,)))

"""The hierarchy: ordered levels of tasks."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from himpc.kinematics.configuration import Configuration
from himpc.tasks import Damping, Task
from himpc.tasks.axes import AXES, OnAxes
from himpc.tasks.task import GAINS
from robots import InputError, Robot
from robots.ranges import Range, Shown, check_fields, check_numbers

Weight = float | tuple[float, ...]
WEIGHTS = Range(1e-12, 1e12)
"""Beyond, the smaller terms of a cost are lost in the rounding of the larger ones."""


@dataclass(frozen=True)
class Level:
    """One priority level: its tasks and the weights of the stage cost (31).

    Attributes:
        tasks: tasks of equal priority.
        Q: weight of the residual e (28), scalar or one per coordinate, > 0.
        R: weight of the increments Δτ, scalar or one per joint, > 0.
        horizon: number of knots that this level looks ahead, at most the controller's N (Remark 8); None: N.
    """

    tasks: tuple[Task, ...]
    # fmt: off
    Q: Annotated[Weight, WEIGHTS, Shown(
        "Q", "Weight of the residual", "", 1.0, 1000.0, 1.0, tries=("20", "100", "200", "500", "2000"),
        name="Q of *")] = 200.0
    R: Annotated[Weight, WEIGHTS, Shown(
        "R", "Weight of the changes of torque", "", 0.1, 100.0, 0.1, tries=("1", "10", "100", "1000"),
        name="R of *")] = 10.0
    horizon: Annotated[int | None, Range(1), Shown(
        "Own N", "Number of knots in this level's horizon, at most N (Remark 8); null: N", name="N of *",
    )] = None
    enabled: Annotated[bool, Shown(
        "Enabled", "Whether the level takes part", tries=("false", "true"), name="level * on")] = True
    # fmt: on

    @property
    def name(self) -> str:
        """The stable identity of the level, independent of its position in the stack."""
        return "+".join(task.name for task in self.tasks)

    def __post_init__(self) -> None:
        if not self.tasks:
            raise InputError("a level needs at least one task: add one or remove the level")
        check_fields(self, f"level '{self.name}': ")
        for task in self.tasks:
            for field in ("K_p", "K_v"):
                check_numbers(f"{field} of task '{task.name}'", getattr(task, field), GAINS)


Stack = tuple[Level, ...]


def check_names(stack: Stack) -> None:
    """Raises InputError if two tasks have the same name: events and telemetry refer to tasks by name."""
    names = [task.name for level in stack for task in level.tasks]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise InputError(f"task name {json.dumps(min(twice))} is used twice in the stack: rename one of them")


def essence(task: Task) -> Task:
    """Returns the task without its gains, which do not change the controlled quantity."""
    return replace(task, K_p=0.0, K_v=0.0)


def about(task: Task) -> Task:
    """Returns the task without gains, name and axes. Tasks with equal results control the same quantity of
    the same frame or joints."""
    task = replace(task, name="", K_p=0.0, K_v=0.0)
    return replace(task, axes=AXES) if isinstance(task, OnAxes) else task


DAMPING_LEVEL = Level((Damping(name="damping"),), Q=200.0, R=10.0)


def ranks(stack: Stack, configuration: Configuration) -> dict[str, tuple[int, int]]:
    """Returns for each enabled level the number of directions that it can control at this configuration, and
    its number of rows.

    The first number is the amount by which the level's Jacobian increases the rank of the levels above. If
    this number is smaller than the number of rows, the levels above or the arm itself leave too few
    directions.
    """
    by_level: dict[str, tuple[int, int]] = {}
    J, before = np.zeros((0, configuration.q.size)), 0
    for level in stack:
        if not level.enabled:
            continue
        rows = [task.jacobian(configuration)[0] for task in level.tasks]
        J = np.vstack([J, *rows])
        rank = int(np.linalg.matrix_rank(J, tol=_RANK)) if np.isfinite(J).all() else before
        by_level[level.name] = (rank - before, sum(map(len, rows)))
        before = rank
    return by_level


_RANK = 1e-6
"""Singular values of a stacked Jacobian that are below this value are treated as zero."""


def freedom_left(robot: Robot, stack: Stack) -> int:
    """Returns n minus the generic rank of the enabled levels' stacked Jacobian.

    The generic rank is the largest rank over a few random configurations, so that a singularity at a single
    configuration does not count as freedom.
    """
    tasks = [task for level in stack if level.enabled for task in level.tasks]
    if not tasks:
        return robot.n
    rng = np.random.default_rng(0)
    data = robot.model.createData()
    low, high = np.maximum(robot.q_lower, -np.pi), np.minimum(robot.q_upper, np.pi)
    rank = 0
    for _ in range(5):
        configuration = Configuration(robot, data, rng.uniform(low, high), np.zeros(robot.n))
        rows = np.vstack([task.jacobian(configuration)[0] for task in tasks])
        rank = max(rank, int(np.linalg.matrix_rank(rows, tol=_RANK)))
    return robot.n - rank

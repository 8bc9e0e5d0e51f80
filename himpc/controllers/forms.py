"""The levels prepared for one set of settings: everything that does not change from tick to tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import LevelProblem
from himpc.configuration import Configuration
from himpc.controllers.settings import Settings
from himpc.prediction.task import ResidualModel, residual_model
from himpc.references import Preview
from himpc.references.hold import still
from himpc.stack import Level
from himpc.tasks import Damping, Task
from robots import InputError, Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class LevelForm:
    """A level with its coefficients.

    Attributes:
        level: the level.
        rows: its rows among those of all levels.
        C: (N, m, N), effect coefficients.
        root_Q: (m,), √Q.
        weighted_C: (K, m, K), √Q C over the level's own knots.
        R: (n,), in the weight's unit.
        knots: the level's own horizon K ≤ N.
    """

    level: Level
    rows: slice
    C: Array
    root_Q: Array
    weighted_C: Array
    R: Array
    knots: int

    def problem(self, B: Array, free: Array, share: float) -> LevelProblem:
        """The level's QP data; `share` of its √Q counts while it fades in."""
        faded = share < 1.0
        return LevelProblem(
            name=self.level.name,
            B=B[:, self.rows],
            C=self.C,
            free=free[:, self.rows],
            root_Q=self.root_Q * share if faded else self.root_Q,
            weighted_C=self.weighted_C * share if faded else self.weighted_C,
            R=self.R,
            knots=self.knots,
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
        """Ĵ of all rows at every knot, (N, m, n)."""
        blocks = [task.jacobian(configuration) for task in self.tasks]
        return blocks[0] if len(blocks) == 1 else np.concatenate(blocks, axis=1)

    def free(
        self, error: Array, velocity: Array, acceleration: Array, previews: Mapping[str, Preview], N: int
    ) -> Array:
        """e at knots 1 … N for Δτ = 0, (N, m), all rows."""
        found = [
            still(N, rows) if isinstance(task, Damping) else previews[task.name]
            for task, rows in zip(self.tasks, self.sizes, strict=True)
        ]
        if len(found) == 1:
            desired = (found[0].displacement, found[0].velocity, found[0].acceleration)
        else:
            desired = (
                np.concatenate([preview.displacement for preview in found], axis=1),
                np.concatenate([preview.velocity for preview in found], axis=1),
                np.concatenate([preview.acceleration for preview in found], axis=1),
            )
        return self.model.free(error, velocity, acceleration, *(rows[1:] for rows in desired))


def measure(
    tasks: Sequence[Task],
    configuration: Configuration,
    previews: Mapping[str, Preview],
    values: dict[str, Array],
    errors: dict[str, Array],
) -> Array:
    """x̃ of tasks, (m,); x and x̃ of each are written to `values` and `errors`."""
    found = []
    for task in tasks:
        value = task.value(configuration)
        error = (
            np.zeros_like(value)
            if isinstance(task, Damping)
            else task.error(value, previews[task.name].value)
        )
        values[task.name], errors[task.name] = value, error
        found.append(error)
    return found[0] if len(found) == 1 else np.concatenate(found)


def stack_form(robot: Robot, levels: Sequence[Level], settings: Settings) -> StackForm:
    """Prepares the levels.

    Raises:
        InputError: a frame or joint is unknown, or a gain or weight has the wrong length.
    """
    configuration = Configuration(robot, robot.model.createData(), robot.home, np.zeros(robot.n))
    N = settings.horizon
    forms: list[LevelForm] = []
    K_p: list[Array] = []
    K_v: list[Array] = []
    start = 0
    for level in levels:
        first = len(K_p)
        for task in level.tasks:
            m = task.jacobian(configuration).shape[1]
            K_p.append(_spread(task.K_p, m, f"K_p of task '{task.name}'"))
            K_v.append(_spread(task.K_v, m, f"K_v of task '{task.name}'"))
        m = sum(len(gain) for gain in K_p[first:])
        R = _spread(level.R, robot.n, f"R of level '{level.name}'")
        root_Q = np.sqrt(_spread(level.Q, m, f"Q of level '{level.name}'"))
        C = residual_model(np.concatenate(K_p[first:]), np.concatenate(K_v[first:]), N, settings.T_s).C
        K = min(level.horizon or N, N)
        forms.append(
            LevelForm(
                level=level,
                rows=slice(start, start + m),
                C=C,
                root_Q=root_Q,
                weighted_C=np.ascontiguousarray(root_Q[:, None] * C[:K, :, :K]),
                R=R / np.array(settings.M_bar) ** 2 if settings.R_on == "acceleration" else R,
                knots=K,
            )
        )
        start += m
    return StackForm(
        levels=tuple(forms),
        tasks=tuple(task for level in levels for task in level.tasks),
        sizes=tuple(len(gain) for gain in K_p),
        model=residual_model(np.concatenate(K_p), np.concatenate(K_v), N, settings.T_s),
    )


def _spread(value: float | tuple[float, ...], size: int, what: str) -> Array:
    values = np.atleast_1d(np.asarray(value, float))
    if values.size not in (1, size):
        raise InputError(f"{what} has {values.size} entries: give one number or {size}")
    return np.array(np.broadcast_to(values, (size,)))

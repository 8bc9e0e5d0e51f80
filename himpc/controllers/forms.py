"""A level prepared for one set of settings: everything that does not change from tick to tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from himpc.configuration import Configuration
from himpc.prediction.task import ResidualModel, residual_model
from himpc.references import Preview
from himpc.stack import Level
from himpc.tasks import Damping
from robots import InputError, Robot

if TYPE_CHECKING:
    from himpc.controllers.himpc import Settings

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class LevelForm:
    """A level with its coefficients.

    Attributes:
        level: the level.
        model: coefficients of the residual, all tasks stacked.
        root_Q: (m,), √Q.
        R: (n,), in the weight's unit.
        knots: the level's own horizon, ≤ N.
    """

    level: Level
    model: ResidualModel
    root_Q: Array
    R: Array
    knots: int

    def jacobian(self, configuration: Configuration) -> Array:
        """Ĵ of all tasks of the level at every knot, (N, m, n)."""
        tasks = self.level.tasks
        if len(tasks) == 1:
            return tasks[0].jacobian(configuration)
        return np.concatenate([task.jacobian(configuration) for task in tasks], axis=1)

    def measure(
        self,
        configuration: Configuration,
        previews: Mapping[str, Preview],
        values: dict[str, Array],
        errors: dict[str, Array],
    ) -> Array:
        """x̃ of all tasks of the level, (m,); x and x̃ of each task are written to `values` and `errors`."""
        found = []
        for task in self.level.tasks:
            value = task.value(configuration)
            error = (
                task.error(value, previews[task.name].value)
                if not isinstance(task, Damping)
                else np.zeros_like(value)
            )
            values[task.name], errors[task.name] = value, error
            found.append(error)
        return found[0] if len(found) == 1 else np.concatenate(found)

    def free(
        self, error: Array, velocity: Array, acceleration: Array, previews: Mapping[str, Preview]
    ) -> Array:
        """e at knots 1 … N for Δτ = 0, (N, m)."""
        tasks = self.level.tasks
        if len(tasks) == 1:
            preview = previews.get(tasks[0].name)
            if preview is None:
                return self.model.free(error, velocity, acceleration, 0.0, 0.0, 0.0)
            desired = (preview.displacement, preview.velocity, preview.acceleration)
            return self.model.free(error, velocity, acceleration, *(row[1:] for row in desired))
        parts = [previews[task.name] for task in tasks]
        desired = (
            np.concatenate([getattr(part, name)[1:] for part in parts], axis=1)
            for name in ("displacement", "velocity", "acceleration")
        )
        return self.model.free(error, velocity, acceleration, *desired)


def level_forms(robot: Robot, levels: Sequence[Level], settings: Settings) -> list[LevelForm]:
    """Prepares the levels.

    Raises:
        InputError: a frame or joint is unknown, or a gain or weight has the wrong length.
    """
    data = robot.model.createData()
    configuration = Configuration(robot, data, robot.home, np.zeros(robot.n))
    M_bar = np.array(settings.M_bar)
    return [_form(robot, level, settings, configuration, M_bar) for level in levels]


def _form(
    robot: Robot, level: Level, settings: Settings, configuration: Configuration, M_bar: Array
) -> LevelForm:
    K_p, K_v = [], []
    for task in level.tasks:
        m = task.jacobian(configuration).shape[1]
        K_p.append(_spread(task.K_p, m, f"K_p of task '{task.name}'"))
        K_v.append(_spread(task.K_v, m, f"K_v of task '{task.name}'"))
    m = sum(len(gain) for gain in K_p)
    R = _spread(level.R, robot.n, f"R of level '{level.name}'")
    return LevelForm(
        level=level,
        model=residual_model(np.concatenate(K_p), np.concatenate(K_v), settings.horizon, settings.T_s),
        root_Q=np.sqrt(_spread(level.Q, m, f"Q of level '{level.name}'")),
        R=R / M_bar**2 if settings.R_on == "acceleration" else R,
        knots=min(level.horizon or settings.horizon, settings.horizon),
    )


def _spread(value: float | tuple[float, ...], size: int, what: str) -> Array:
    values = np.atleast_1d(np.asarray(value, float))
    if values.size not in (1, size):
        raise InputError(f"{what} has {values.size} entries: give one number or {size}")
    return np.array(np.broadcast_to(values, (size,)))

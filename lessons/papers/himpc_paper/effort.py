"""The cost with ‖τ‖² instead of ‖Δτ‖²; section IV-C argues against ‖τ‖²."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

from himpc.formulation.forms import StackForm, measure, stack_form
from himpc.kinematics.configuration import Configuration
from himpc.references import Preview
from himpc.references.hold import still
from lessons.experiments.jobs import JobResult, Work
from lessons.scenes.catalog import prepared, torque_scene
from robots import Plant

Array = NDArray[np.float64]

_LOST = 0.5
"""m or rad: an error above this counts as loss of control."""


@final
@dataclass(frozen=True)
class EffortJob(Work):
    """A run with all tasks of a scene in one cost, one step ahead, without bounds and priorities.

    The problem is min ‖e_{k+1}‖² + R‖Δτ‖² or min ‖e_{k+1}‖² + R‖τ₀ + Δτ‖², with e of (28) by the incremental
    system and N = 1. R stands for R_i/Q_i; the paper's weights give 0.05.

    Attributes:
        effort: the quantity that R weighs: the "increment" Δτ or the whole "torque" τ.
        R: its weight.
        hold_deg: joint angles to hold, degrees, instead of following the scene's references.
    """

    effort: Literal["increment", "torque"] = "increment"
    R: float = 0.05
    hold_deg: tuple[float, ...] = ()

    def do(self) -> JobResult:
        """Returns the run; see `Work.do`."""
        scene = prepared(torque_scene(self.spec.scene), self.spec.controller, self.spec.set)
        robot, T_s = scene.robot, scene.settings.T_s
        form = stack_form(robot, scene.settings.levels, replace(scene.settings.for_controller(), horizon=1))
        gain = np.concatenate([level.C[0, :, 0] for level in form.levels])
        M_bar = np.array(scene.settings.M_bar)
        q_0 = np.radians(self.hold_deg) if self.hold_deg else scene.q_0
        plant = Plant(robot, scene.settings.plant)
        plant.reset(q_0)
        data = robot.model.createData()
        references = scene.references(robot, scene.settings.levels)
        start = Configuration(robot, data, q_0, np.zeros(robot.n))
        values = {task.name: task.value(start) for task in form.tasks}
        ticks = round((scene.duration if self.spec.duration is None else self.spec.duration) / T_s)
        errors: list[Array] = []
        before = np.zeros(sum(form.sizes))
        for k in range(ticks):
            previews = {
                task.name: still(1, rows)._replace(value=values[task.name])
                if self.hold_deg
                else references[task.name].preview(k * T_s, T_s, 1)
                for task, rows in zip(form.tasks, form.sizes, strict=True)
            }
            J, error, free, before = _residual(
                form, Configuration(robot, data, plant.q, plant.v), previews, before, T_s
            )
            errors.append(error)
            if not np.abs(error).max() <= _LOST:
                break
            G = gain[:, None] * J / M_bar
            pull = self.R * plant.tau if self.effort == "torque" else 0.0
            change = np.linalg.solve(G.T @ G + self.R * np.eye(robot.n), -(G.T @ free + pull))
            plant.step(plant.tau + change, T_s)
        t = np.array([T_s * k for k in range(len(errors))])
        return JobResult(self, _summary(form, t, np.array(errors), len(errors) < ticks), {"t": t[:, None]})

    @property
    def words(self) -> str:
        """The run in words, because no single command repeats the run."""
        what = "still" if self.hold_deg else "moving"
        return f"{self.spec.scene}, {what}, R = {self.R:g} on the {self.effort}"


def _residual(
    form: StackForm, at: Configuration, previews: Mapping[str, Preview], before: Array, T_s: float
) -> tuple[Array, Array, Array, Array]:
    """Returns J, x̃, e_{k+1} for Δτ = 0, and ẋ."""
    J = form.jacobian(at)[0]
    error = measure(form.tasks, at, previews, {}, {})
    x_dot = J @ at.v
    free = form.free(error, x_dot, (x_dot - before) / T_s, previews, 1)[0]
    return J, error, free, x_dot


def _summary(form: StackForm, t: Array, errors: Array, lost: bool) -> dict[str, Any]:
    """Returns the part of a run's summary that `JobResult.error_of` needs."""
    late = errors[t >= 1.0]
    rmse = np.sqrt((late**2).mean(axis=0)) if len(late) and not lost else np.full(errors.shape[1], np.nan)
    ends = np.cumsum(form.sizes)
    tasks = [
        {"name": task.name, "rmse_after_1s": rmse[end - rows : end].tolist()}
        for task, rows, end in zip(form.tasks, form.sizes, ends, strict=True)
    ]
    return {"diverged": lost, "diverged_at_s": float(t[-1]) if lost else None, "tasks": tasks}

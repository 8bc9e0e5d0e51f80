"""Measures the statements that the paper makes without numbers: Remarks 5, 6 and 8, and section IV-C."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, final

import numpy as np

from himpc.formulation.forms import StackForm, measure, stack_form
from himpc.kinematics.configuration import Configuration
from himpc.references import Preview
from himpc.references.curves import still
from lessons.experiments.jobs import Job, JobResult, Results, Work
from lessons.papers.himpc_paper.iiwa import RT4, RT4_DATA_SHEET, step_seconds
from lessons.papers.himpc_paper.planar import RT1
from lessons.papers.item import PaperCheck, Section, Table
from lessons.papers.texts import described
from lessons.papers.words import number, stated, trouble
from lessons.plots.panels import Panel, Picture, PlotCurve
from lessons.scenes.catalog import prepared, torque_scene
from lessons.scenes.run_spec import RunSpec
from robots import Plant
from robots.arrays import Array

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
    free = form.model.free(error, x_dot, (x_dot - before) / T_s, *form.motion(previews, 1)[:, 1:])[0]
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


_FAINTEST = 1e-3
"""mm: smaller errors are drawn at this value, since a logarithmic axis has no zero."""


def _level_1(run: JobResult, scale: float = 1e3) -> float:
    """Returns the largest RMSE of level 1's coordinates after the first second, mm; NaN if control was
    lost."""
    if not run.completed:
        return math.nan
    return scale * max(value for value in run.summary["tasks"][0]["rmse_after_1s"])


def _line(runs: Mapping[float, JobResult], label: str, colour: str) -> PlotCurve:
    errors = np.array([_level_1(run) for run in runs.values()])
    return PlotCurve(np.array(list(runs)), np.maximum(errors, _FAINTEST), label, colour)


# -------------------------------------------------------------------------------- Remark 8

_N = 20
_SHORTER = {False: (20, 10, 5, 2, 1), True: (20, 5, 1)}
"""Numbers of knots of the lower levels. Here and in the tables below, the key True stands for the quick
version."""


def _shorter(knots: int, timed: bool) -> Job:
    extra = () if knots == _N else tuple(f"levels.{level}.horizon={knots}" for level in (2, 3))
    return Job(
        RunSpec(RT4, controller="himpc", set=(f"horizon={_N}", *extra), duration=0.3 if timed else 2.5),
        timed=timed,
    )


def _remark_8(results: Results, quick: bool) -> Section:
    rows, medians, errors = [], [], []
    for knots in _SHORTER[quick]:
        run, clock = results[_shorter(knots, False)], results[_shorter(knots, True)]
        medians.append(1e3 * step_seconds(clock)["median"])
        errors.append([_level_1(run), run.error_of("orientation", 2), run.error_of("q1")])
        rows.append((str(knots), number(medians[-1]), *map(number, errors[-1]), trouble(run)))
    x = np.array(_SHORTER[quick], float)
    panels = (
        Panel("median step (ms)", (PlotCurve(x, np.array(medians), colour="0"),), "knots of levels 2 and 3"),
        Panel(
            "RMSE / RMSE with all knots",
            tuple(
                PlotCurve(x, np.array([values[k] / errors[0][k] for values in errors]), label, str(k))
                for k, label in enumerate(("level 1, worst axis", "$o_Z$", "$q_1$"))
            ),
            "knots of levels 2 and 3",
        ),
    )
    columns = ("knots of levels 2 and 3", "median step (ms)", "level 1 (mm)", "o_Z (deg)", "q₁ (deg)", "")
    return Section(
        notes=(
            f"**Remark 8, shorter horizons for lower levels.** The horizon of level 1 has {_N} knots, those "
            "of levels 2 and 3 have fewer; R weighs Δτ as printed. With one knot for levels 2 and 3, a step "
            f"takes {number(medians[-1] / medians[0])} of the time with all knots: most of a step is spent "
            "on kinematics and null spaces, which level 1 needs at every knot.",
        ),
        tables=(Table("Remark 8: time against accuracy", columns, tuple(rows)),),
        pictures=(Picture("himpc-remark-8", "Shorter horizons for lower levels, RT4.", panels, 2),),
    )


# -------------------------------------------------------------------------------- Remarks 5 and 6

_PERIODS = (0.5, 1.0, 2.0, 4.0)
_LAGS = {False: (0.0, 0.5, 1.0, 2.0, 4.0, 8.0), True: (0.0, 2.0, 8.0)}
_SCENES = {False: (RT1, RT4_DATA_SHEET), True: (RT1,)}


def _period_job(scene: str, ms: float) -> Job:
    return Job(RunSpec(scene, controller="himpc", set=() if ms == 1.0 else (f"T_s={ms * 1e-3:g}",)))


def _lag_job(scene: str, ms: float) -> Job:
    return Job(RunSpec(scene, controller="himpc", set=() if ms == 0.0 else (f"plant.torque_lag_ms={ms:g}",)))


def _over(
    title: str,
    what: str,
    values: tuple[float, ...],
    runs: Mapping[str, Mapping[float, JobResult]],
    note: str,
    log: bool,
) -> Section:
    curves = tuple(_line(runs[scene], scene, str(k)) for k, scene in enumerate(runs))
    rows = tuple(
        (f"{value:g}", *(number(_level_1(runs[scene][value])) for scene in runs)) for value in values
    )
    lost = [f"{scene} at {value:g}: {trouble(run)}" for scene in runs for value, run in runs[scene].items()]
    troubles = "; ".join(text for text in lost if not text.endswith(": "))
    panel = Panel("level-1 RMSE, worst axis (mm)", curves, what, log_x=log, log_y=True)
    return Section(
        notes=(note, *((f"Lost: {troubles}.",) if troubles else ())),
        tables=(Table(f"{title}: level-1 RMSE, worst axis (mm)", (what, *runs), rows),),
        pictures=(
            Picture(
                f"himpc-{title.lower().replace(' ', '-')}", f"Level-1 RMSE by the {what.lower()}.", (panel,)
            ),
        ),
    )


def _remark_6(results: Results, quick: bool) -> Section:
    runs = {scene: {ms: results[_period_job(scene, ms)] for ms in _PERIODS} for scene in _SCENES[quick]}
    note = "**Remark 6, sampling period.** T_s is also the delay of time-delay estimation; M̄ is fixed."
    section = _over("Remark 6", "sampling period (ms)", _PERIODS, runs, note, log=True)
    ratio = _level_1(runs[RT1][4.0]) / _level_1(runs[RT1][0.5])
    words = "the longer the period, the larger the estimation error"
    row = stated(f"{RT1}: level-1 RMSE at 4 ms over that at 0.5 ms", ratio, "period_matters", words)
    return replace(section, rows=(row,))


def _remark_5(results: Results, quick: bool) -> Section:
    runs = {scene: {ms: results[_lag_job(scene, ms)] for ms in _LAGS[quick]} for scene in _SCENES[quick]}
    note = (
        "**Remark 5, actuators.** The torque follows the commanded torque with a first-order lag; the "
        "controller's τ₀ is the torque that acted. Time-delay estimation compensates a lag that is short "
        "compared with the time constants of the closed loop, but not a long one."
    )
    return _over("Remark 5", "motor time constant (ms)", _LAGS[quick], runs, note, log=False)


# -------------------------------------------------------------------------------- Section IV-C

_WEIGHTS = {False: (1e-4, 1e-3, 1e-2, 5e-2, 1.0, 10.0), True: (1e-4, 5e-2, 1.0)}
_REFERENCES = {
    "RT4": (),
    "still, folded up": (0.0, 30.0, 0.0, 20.0, 0.0, 10.0, 0.0),
    "still, stretched out": (0.0, 90.0, 0.0, 10.0, 0.0, 10.0, 0.0),
}
_EFFORTS: dict[str, Literal["increment", "torque"]] = {"Δτ": "increment", "τ": "torque"}
_TEX = {"Δτ": r"\Delta\tau", "τ": r"\tau"}
_FINE = 1.0
"""mm: level-1 accuracy that a weight must allow."""


def _effort_job(effort: str, R: float, reference: str) -> EffortJob:
    return EffortJob(
        RunSpec(RT4_DATA_SHEET, controller="himpc", duration=2.0),
        effort=_EFFORTS[effort],
        R=R,
        hold_deg=_REFERENCES[reference],
    )


def _effort_jobs(quick: bool) -> tuple[EffortJob, ...]:
    return tuple(_effort_job(e, R, r) for e in _EFFORTS for R in _WEIGHTS[quick] for r in _REFERENCES)


def _section_4c(results: Results, quick: bool) -> Section:
    rows, panels, usable = [], [], {}
    for effort in _EFFORTS:
        curves, good = [], []
        for k, reference in enumerate(_REFERENCES):
            runs = {R: results[_effort_job(effort, R, reference)] for R in _WEIGHTS[quick]}
            curves.append(_line(runs, reference, str(k)))
            fine = {R for R, run in runs.items() if _level_1(run) <= _FINE}
            good.append(fine)
            rows.append(
                (
                    effort,
                    reference,
                    *((trouble(run) and "lost") or number(_level_1(run)) for run in runs.values()),
                )
            )
        usable[effort] = set.intersection(*good)
        panels.append(
            Panel(
                "level-1 RMSE, worst axis (mm)",
                tuple(curves),
                "R (paper: 0.05)",
                title=f"$\\|{_TEX[effort]}\\|^2$ in the cost",
                bounds=(_FINE,),
                log_x=True,
                log_y=True,
                y_range=(1e-3, 1e3),
            )
        )
    columns = ("R weighs", "reference", *(f"R = {R:g}" for R in _WEIGHTS[quick]))
    return Section(
        notes=(
            "**Section IV-C, ‖τ‖² instead of ‖Δτ‖².** All tasks are in one cost, one step ahead, so that "
            "only the regularisation differs. Holding a pose needs torque, and ‖τ‖² weighs this torque "
            "against the accuracy: with more gravity, R must be smaller. But RT4 starts in a singular pose, "
            "where control is lost with a small R. ‖Δτ‖² is zero at rest in every pose.",
        ),
        tables=(Table("Section IV-C: level-1 RMSE, worst axis (mm)", columns, tuple(rows)),),
        checks=(
            PaperCheck(
                f"with ‖Δτ‖²: number of the tried R that keep all references within {_FINE:g} mm",
                float(len(usable["Δτ"])),
                len(usable["Δτ"]) > 0,
            ),
            PaperCheck(
                "with ‖τ‖²: number of the tried R that do the same, fewer than with ‖Δτ‖²",
                float(len(usable["τ"])),
                len(usable["τ"]) < len(usable["Δτ"]),
            ),
        ),
        pictures=(
            Picture(
                "himpc-section-4c",
                "What R weighs, and which R each reference needs (gaps: control lost).",
                tuple(panels),
                2,
            ),
        ),
    )


# -------------------------------------------------------------------------------- all


def _jobs(quick: bool) -> tuple[Work, ...]:
    return (
        *(_shorter(knots, timed) for knots in _SHORTER[quick] for timed in (False, True)),
        *(_period_job(scene, ms) for scene in _SCENES[quick] for ms in _PERIODS),
        *(_lag_job(scene, ms) for scene in _SCENES[quick] for ms in _LAGS[quick]),
        *_effort_jobs(quick),
    )


def _section(results: Results, quick: bool) -> Section:
    parts = [part(results, quick) for part in (_remark_8, _remark_6, _remark_5, _section_4c)]
    return Section(
        notes=tuple(note for part in parts for note in part.notes),
        rows=tuple(row for part in parts for row in part.rows),
        tables=tuple(table for part in parts for table in part.tables),
        checks=tuple(check for part in parts for check in part.checks),
        pictures=tuple(picture for part in parts for picture in part.pictures),
    )


ITEMS = (described("himpc-ablations", _jobs, _section),)

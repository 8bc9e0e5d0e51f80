"""Measures the errors of the incremental and of the nominal model, section III-B."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from himpc.kinematics.configuration import Configuration
from lessons.experiments.jobs import Job, JobResult, Results
from lessons.papers.himpc_paper.planar import RT1
from lessons.papers.item import Item, Section, Table, between
from lessons.papers.words import number, trouble
from lessons.plots.panels import Panel, Picture, PlotCurve
from lessons.scenes.catalog import prepared, torque_scene
from lessons.scenes.run_spec import RunSpec
from robots import NominalModel

PERIODS = (0.5, 1.0, 2.0, 4.0)
"""Sampling periods T_s, ms."""
SCALES = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Factors on M̄."""
_RT4 = Job(
    RunSpec("iiwa14-circle", controller="himpc", set=("nominal.mass_scale=0.8", "nominal.inertia_scale=0.8"))
)
_EVERY = 4
"""Number of ticks from one evaluated tick to the next, since neighbouring ticks are nearly equal."""


def _at_period(ms: float) -> Job:
    return Job(RunSpec(RT1, controller="himpc", set=() if ms == 1.0 else (f"T_s={ms * 1e-3:g}",)))


def _at_scale(scale: float) -> Job:
    return Job(RunSpec(RT1, controller="himpc", set=() if scale == 1.0 else (f"M_bar_scale={scale:g}",)))


@dataclass(frozen=True)
class ModelErrors:
    """RMS of the norms after the first second.

    Attributes:
        gamma: of q̈ by the nominal model, (21), rad/s².
        delta: of q̈ by the incremental system, (25), rad/s².
        beta: of ẍ of level 1 by the nominal model, (24), m/s².
        epsilon: of ẍ of level 1 by the incremental system, (27), m/s².
    """

    gamma: float
    delta: float
    beta: float
    epsilon: float


def model_errors(run: JobResult) -> ModelErrors:
    """Returns the errors along a run, from their definitions.

    q̈_k is the mean acceleration of period k, from the plant's true velocities. γ_k = M_n⁻¹(τ_k − N_n) − q̈_k
    is expanded in (21). δ_k = q̈_k − q̈_{k−1} − M̄⁻¹(τ_k − τ_{k−1}), the M̄⁻¹ε_q of (16), is expanded in
    (25). β = J₁γ and ε_x = J₁δ. A run that failed or lost control gives NaN.
    """
    if not run.completed:
        return ModelErrors(math.nan, math.nan, math.nan, math.nan)
    scene = prepared(torque_scene(run.job.spec.scene), run.controller, run.job.spec.set)
    settings, robot = scene.settings, scene.robot
    M_bar = np.array(settings.M_bar) * settings.M_bar_scale
    nominal = NominalModel(robot, settings.nominal)
    data = robot.model.createData()
    q, v, tau = run["q"], run["v"], run["tau"]
    acceleration = np.diff(v, axis=0) / settings.T_s
    increments = np.diff(acceleration, axis=0) - np.diff(tau[:-1], axis=0) / M_bar
    squares = []
    for k in range(math.ceil(1.0 / settings.T_s), len(acceleration), _EVERY):
        gamma = np.linalg.solve(nominal.mass_matrix(q[k]), tau[k] - nominal.bias(q[k], v[k]))
        gamma = gamma - acceleration[k]
        delta = increments[k - 1]
        at = Configuration(robot, data, q[k], v[k])
        J = np.vstack([task.jacobian(at)[0] for task in settings.levels[0].tasks])
        squares.append([float(vector @ vector) for vector in (gamma, delta, J @ gamma, J @ delta)])
    return ModelErrors(*np.sqrt(np.mean(squares, axis=0)).tolist())


def _jobs(quick: bool) -> tuple[Job, ...]:
    scales = SCALES if not quick else (1.0,)
    return (*map(_at_period, PERIODS), *map(_at_scale, scales), *(() if quick else (_RT4,)))


def _section(results: Results, quick: bool) -> Section:
    periods = {ms: results[_at_period(ms)] for ms in PERIODS}
    scales = {} if quick else {scale: results[_at_scale(scale)] for scale in SCALES}
    rows = [(f"{RT1}, T_s = {ms:g} ms", run) for ms, run in periods.items()]
    rows += [(f"{RT1}, M̄ × {scale:g}", run) for scale, run in scales.items() if scale != 1.0]
    rows += [] if quick else [("iiwa14-circle", results[_RT4])]
    errors = {words: model_errors(run) for words, run in rows}
    checks = [
        between(f"{words}: γ of (21) over δ of (25)", errors[words].gamma / errors[words].delta, 10.0, 1e3)
        for words in (f"{RT1}, T_s = 1 ms",)
    ]
    table = Table(
        "RMS after the first second",
        ("run", "γ (21), rad/s²", "δ (25), rad/s²", "γ/δ", "β (24), m/s²", "ε_x (27), m/s²", ""),
        tuple(
            (
                words,
                number(errors[words].gamma),
                number(errors[words].delta),
                number(errors[words].gamma / errors[words].delta),
                number(errors[words].beta),
                number(errors[words].epsilon),
                trouble(run),
            )
            for words, run in rows
        ),
    )
    panels = [_panel(r"$T_s$ (ms)", {ms: model_errors(run) for ms, run in periods.items()})]
    if scales:
        panels.append(_panel(r"factor on $\bar M$", {s: model_errors(run) for s, run in scales.items()}))
    caption = "Errors of the nominal model (20 % too light, no friction) and of the incremental one on RT1."
    return Section(
        notes=(
            "The error of the next acceleration that each model predicts along HIMPC's own motion, from the "
            "definitions of the errors. The nominal model is 20 % too light and has no friction. On the iiwa "
            "two things reduce the advantage of the incremental model: bounds that become active and "
            "inactive change q̈ from tick to tick, and M̄ is far below M.",
        ),
        tables=(table,),
        checks=tuple(checks),
        pictures=(Picture("himpc-accuracy", caption, tuple(panels), len(panels)),),
    )


def _panel(label: str, errors: dict[float, ModelErrors]) -> Panel:
    x = np.array(list(errors))

    def line(field: str, symbol: str, colour: str) -> PlotCurve:
        return PlotCurve(
            x, np.array([getattr(run_errors, field) for run_errors in errors.values()]), symbol, colour
        )

    curves = (
        line("gamma", r"$\gamma$ (21), rad/s²", "1"),
        line("delta", r"$\delta$ (25), rad/s²", "0"),
        line("beta", r"$\beta_1$ (24), m/s²", "5"),
        line("epsilon", r"$\varepsilon_x$ (27), m/s²", "4"),
    )
    return Panel("RMS error", curves, label, log_x=True, log_y=True)


ITEMS = (
    Item(
        "himpc-accuracy",
        "Accuracy of the incremental model",
        "HIMPC (T-RO 2024), section III-B, (21), (24), (25), (27)",
        _jobs,
        _section,
    ),
)

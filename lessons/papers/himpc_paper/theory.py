"""What section III-B says of the two models' errors, and section IV-B of the value function V_N(k)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from himpc.kinematics.configuration import Configuration
from lessons.experiments.jobs import Job, JobResult, Results
from lessons.papers.himpc_paper.planar import RT1
from lessons.papers.item import PaperCheck, Section, Table, between
from lessons.papers.texts import described, drawn
from lessons.papers.words import number, trouble
from lessons.plots.panels import Panel, PlotCurve
from lessons.scenes.catalog import prepared, torque_scene
from lessons.scenes.run_spec import RunSpec
from robots import NominalModel
from robots.arrays import Array

# ---------------------------------------- section III-B: the errors of the models

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

    @property
    def advantage(self) -> float:
        """γ over δ."""
        return self.gamma / self.delta

    @property
    def shown(self) -> tuple[float, ...]:
        """The numbers of a row of the table."""
        return self.gamma, self.delta, self.advantage, self.beta, self.epsilon


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


def _accuracy_jobs(quick: bool) -> tuple[Job, ...]:
    scales = SCALES if not quick else (1.0,)
    return (*map(_at_period, PERIODS), *map(_at_scale, scales), *(() if quick else (_RT4,)))


def _accuracy(results: Results, quick: bool) -> Section:
    errors = {job: model_errors(results[job]) for job in dict.fromkeys(_accuracy_jobs(quick))}
    rows = [(f"{RT1}, T_s = {ms:g} ms", _at_period(ms)) for ms in PERIODS]
    if not quick:
        rows += [(f"{RT1}, M̄ × {scale:g}", _at_scale(scale)) for scale in SCALES if scale != 1.0]
        rows += [("iiwa14-circle", _RT4)]
    check = between(
        f"{RT1}, T_s = 1 ms: γ of (21) over δ of (25)", errors[_at_period(1.0)].advantage, 10.0, 1e3
    )
    table = Table(
        "RMS after the first second",
        ("run", "γ (21), rad/s²", "δ (25), rad/s²", "γ/δ", "β (24), m/s²", "ε_x (27), m/s²", ""),
        tuple((words, *map(number, errors[job].shown), trouble(results[job])) for words, job in rows),
    )
    panels = [_panel(r"$T_s$ (ms)", {ms: errors[_at_period(ms)] for ms in PERIODS})]
    if not quick:
        panels.append(_panel(r"factor on $\bar M$", {scale: errors[_at_scale(scale)] for scale in SCALES}))
    return drawn("himpc-accuracy", panels, len(panels), tables=(table,), checks=(check,))


def _panel(label: str, errors: dict[float, ModelErrors]) -> Panel:
    x = np.array(list(errors))
    curves = tuple(
        PlotCurve(x, np.array([getattr(of_run, field) for of_run in errors.values()]), symbol, colour)
        for field, symbol, colour in (
            ("gamma", r"$\gamma$ (21), rad/s²", "1"),
            ("delta", r"$\delta$ (25), rad/s²", "0"),
            ("beta", r"$\beta_1$ (24), m/s²", "5"),
            ("epsilon", r"$\varepsilon_x$ (27), m/s²", "4"),
        )
    )
    return Panel("RMS error", curves, label, log_x=True, log_y=True)


# ---------------------------------------- section IV-B: the value function

_JOB = Job(RunSpec("iiwa14-circle", controller="himpc", duration=1.5))
"""The run starts from rest, but the reference starts with a velocity, so that V_N begins far above its final
value."""
_LEVELS = ("position", "orientation", "q1")
_SETTLED_AFTER = 1.0
_FAR = 10.0
"""V_N above this many times ε_N counts as far from the reference."""


def decrease(V: Array, t: Array) -> tuple[float, float]:
    """Returns (ε_N, α) with V(k+1) − V(k) ≤ −α V(k) + ε_N on all ticks far from the reference, see (39).

    ε_N is the largest value after V has settled. α is the largest value for which (39) holds with this ε_N at
    all ticks before, as long as V > 10 ε_N. If α > 0, V decreases there. Without such ticks α is NaN.
    """
    late = V[t >= _SETTLED_AFTER]
    if not len(late):
        return float("nan"), float("nan")
    epsilon = float(late.max())
    ends = np.flatnonzero(_FAR * epsilon >= V)
    first = int(ends[0]) if len(ends) else len(V) - 1
    if first < 2:
        return epsilon, float("nan")
    far = V[: first + 1]
    return epsilon, float(((far[:-1] - far[1:] + epsilon) / far[:-1]).min())


def _value_function(results: Results, quick: bool) -> Section:
    run = results[_JOB]
    epsilon, alpha = decrease(run.column("cost/position"), run.t)
    curves = tuple(_value(run, level, k) for k, level in enumerate(_LEVELS))
    V = run.column("cost/position")
    ratio = PlotCurve(V[:-1], V[1:] / V[:-1], "level 1", "0", "dots") if len(V) else PlotCurve(V, V)
    panels = (
        Panel("$V_N(k)$", curves, log_y=True),
        Panel(
            "$V_N(k+1) / V_N(k)$, level 1",
            (ratio,),
            "$V_N(k)$, level 1",
            title="below 1 it decreases",
            bounds=(1.0,),
            log_x=True,
            y_range=(0.0, 2.0),
        ),
    )
    return drawn(
        "himpc-value",
        panels,
        notes=(
            "V_N(k) is the optimal cost of each level, from the telemetry. By (39), the cost of level 1 must "
            "decrease as long as it is far above the bound ε_N that the estimation error leaves. The cost of "
            "a lower level decreases only as far as level 1 permits. "
            f"ε_N = {number(epsilon)}. {trouble(run)}",
        ),
        checks=(
            PaperCheck(
                f"level 1, ticks with V_N above {_FAR:g} ε_N: least α of (39) > 0",
                alpha,
                bool(alpha > 0),
            ),
        ),
    )


def _value(run: JobResult, level: str, index: int) -> PlotCurve:
    return PlotCurve(run.t, run.column(f"cost/{level}"), f"level {index + 1}", str(index))


ITEMS = (
    described("himpc-accuracy", _accuracy_jobs, _accuracy),
    described("himpc-value", (_JOB,), _value_function),
)

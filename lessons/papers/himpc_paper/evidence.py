"""Measurements for the texts of "Where we disagree with the papers" that belong to no table of the paper."""

from __future__ import annotations

import math
from itertools import starmap

import numpy as np

from himpc.kinematics.configuration import Configuration
from lessons.experiments.jobs import Job, JobResult, Results
from lessons.papers.himpc_paper.iiwa import RT4, rt4
from lessons.papers.himpc_paper.planar import ENCODER, RT1, level_1, roughness, rt1, rt2, rt3
from lessons.papers.item import Row, Section
from lessons.papers.texts import described
from lessons.papers.words import number, printed, trouble, unprinted
from lessons.plots.style import name
from lessons.scenes.catalog import prepared, torque_scene
from robots import Plant, convergence_gauge

DEG = 180 / np.pi

_LARGE = 5.0
"""deg: an error of q₁ above this counts as large; in our run the error grows from 1° to 5° in 0.2 s."""
_HALF_SWING = "q1_amplitude_deg=-60"
_SOFT = "R=1e5"
_BARE = "plant.friction=0"
_UNDAMPED = (_BARE, "plant.damping=0")
_ON_ACCELERATION = (*ENCODER, "R_on=acceleration")
_THIRD = "M_bar_scale=0.3"
_OTHERS = {"M̄ × 0.3": (_THIRD,), "the paper's encoder": ENCODER}
_EARLY = 1.2
"""Time at the start of RT4, s, in which no joint is near a limit."""


def _lost(run: JobResult) -> float:
    return math.nan if run.lost_at is None else run.lost_at


# ------------------------------------------------------------------------ RT2: the conflict

_LOST = ("osf", "tdeosf")


def _conflict_jobs(quick: bool) -> tuple[Job, ...]:
    both = (rt2("himpc"), *(rt2(controller) for controller in _LOST))
    if quick:
        return both
    others = (make("himpc", *extra) for make in (rt1, rt2) for extra in _OTHERS.values())
    return (*both, rt1("himpc"), rt2("himpc", _HALF_SWING), *others)


def _conflict(results: Results, quick: bool) -> Section:
    run = results[rt2("himpc")]
    text = printed("himpc_text")
    large = run.t[np.abs(DEG * run.column("error/q1")) > _LARGE] if len(run.t) else np.array([math.nan])
    rows = [
        Row(
            f"RT2: q₁'s error is large {word}",
            "s",
            text[f"conflict_{word}"],
            float(large[index]),
            f"the paper does not print the size of this swing; here an error above {_LARGE:g}° is large",
            topic="conflict-reaches-level-1",
        )
        for word, index in (("from", 0), ("until", -1))
    ]
    swing, turns = _swing(run, 2.0, 6.0)
    own = [
        ("RT2, 2 to 6 s: largest speed of joint 3", "deg/s", swing),
        ("RT2, 2 to 6 s: how often joint 3 swings", "Hz", turns),
        *(
            (f"{name(controller)} on RT2: control is lost at", "s", _lost(results[rt2(controller)]))
            for controller in _LOST
        ),
    ]
    if not quick:
        half = level_1(results[rt2("himpc", _HALF_SWING)]) / level_1(results[rt1("himpc")])
        own.append(("HIMPC, q₁ swings by −60°: level-1 RMSE in RT2 over RT1", "1", half))
        for words, extra in _OTHERS.items():
            ratio = level_1(results[rt2("himpc", *extra)]) / level_1(results[rt1("himpc", *extra)])
            own.append((f"HIMPC, {words}: level-1 RMSE in RT2 over RT1", "1", ratio))
    return Section(rows=(*rows, *starmap(unprinted, own)))


def _swing(run: JobResult, start: float, end: float) -> tuple[float, float]:
    """Returns the largest speed of joint 3, deg/s, and half the number of its changes of direction per
    second."""
    v = DEG * run.column("v", 2)[(run.t >= start) & (run.t <= end)]
    if not len(v):
        return math.nan, math.nan
    turns = np.count_nonzero(np.diff(np.sign(v)))
    return float(np.abs(v).max()), 0.5 * turns / (end - start)


# ------------------------------------------------------------------------ R compared with Q


def weakest(scene: str) -> float:
    """Returns Q/R·σ²: the effect of the first increment on e divided by its cost, at the start, in the
    direction of level 1 in which the effect is smallest. σ² is the least eigenvalue of c₀² J₁ M̄⁻² J₁ᵀ, c₀ =
    1 + K_V T_s; in that direction a tick leaves 1/(1 + Q/R·σ²) of e."""
    ready = prepared(torque_scene(scene), "himpc", ())
    robot, settings = ready.robot, ready.settings
    (task,) = settings.levels[0].tasks
    J = task.jacobian(Configuration(robot, robot.model.createData(), ready.q_0, np.zeros(robot.n)))[0]
    c_0 = 1.0 + float(np.max(task.K_v)) * settings.T_s
    sigma = np.linalg.svd(c_0 * J / np.array(settings.M_bar), compute_uv=False)
    return float(np.min(settings.levels[0].Q) / np.max(settings.levels[0].R) * sigma[-1] ** 2)


def _radius(scene: str) -> float:
    """Returns the spectral radius of I − M⁻¹M̄ of the plant at the start."""
    ready = prepared(torque_scene(scene), "himpc", ())
    plant = Plant(ready.robot, ready.settings.plant)
    plant.reset(ready.q_0)
    return convergence_gauge(plant.mass_matrix(), np.array(ready.settings.M_bar))[1]


def _weights(results: Results, quick: bool) -> Section:
    scenes = (("RT1", RT1), ("RT4", RT4))
    ratio, radius = "Q over R for level 1's weakest direction", "spectral radius of I − M⁻¹M̄"
    return Section(
        rows=tuple(
            unprinted(f"{words}: {what} at the start", "1", of(scene))
            for what, of in ((ratio, weakest), (radius, _radius))
            for words, scene in scenes
        ),
    )


# ------------------------------------------------------------------------ other settings


def _settings_jobs(quick: bool) -> tuple[Job, ...]:
    if quick:
        return ()
    return (
        rt1("himpc"),
        rt1("himpc", _SOFT),
        rt1("himpc", _THIRD),
        rt1("himpc", *ENCODER),
        rt1("himpc", *_ON_ACCELERATION),
        rt1("osf"),
        rt1("osf", _BARE),
        rt1("osf", *_UNDAMPED),
        rt3("hqp"),
        rt4("himpc", "horizon=1", seconds=_EARLY),
        rt4("himpc", "horizon=20", seconds=_EARLY),
    )


def _settings(results: Results, quick: bool) -> Section:
    if quick:
        return Section(notes=("Only in the whole version.",))
    own, noisy = results[rt1("himpc")], results[rt1("himpc", *ENCODER)]
    soft = results[rt1("himpc", *_ON_ACCELERATION)]
    third, straight = results[rt1("himpc", _THIRD)], results[rt3("hqp")]
    one, twenty = (results[rt4("himpc", f"horizon={N}", seconds=_EARLY)] for N in (1, 20))
    rows = [
        *(
            (
                f"RT1, R = 1e5: RMSE of {label} over that with R = 10",
                "1",
                results[rt1("himpc", _SOFT)].error_of(task) / own.error_of(task),
            )
            for label, task in (("x", "position"), ("q1", "q1"))
        ),
        (
            "RT1, encoder, R on M̄⁻¹Δτ: RMS of Δτ over that with R on Δτ",
            "1",
            roughness(soft) / roughness(noisy),
        ),
        (
            "RT1, encoder, R on M̄⁻¹Δτ: level-1 RMSE over that with R on Δτ",
            "1",
            level_1(soft) / level_1(noisy),
        ),
        *(
            (
                f"RT1: average cost of level {k + 1} with the encoder over that without",
                "1",
                noisy.figure("average_cost", k) / own.figure("average_cost", k),
            )
            for k in (0, 1)
        ),
        *((f"RT1, encoder, HIMPC: {label}", "m", noisy.error_of("position", k)) for k, label in _AXES),
        *((f"RT1, M̄ × 0.3, HIMPC: {label}", "m", third.error_of("position", k)) for k, label in _AXES),
        ("RT1, M̄ × 0.3, HIMPC: q1", "deg", third.error_of("q1")),
        *(
            (f"RT1, OSF, {words}: {label}", unit, results[rt1("osf", *extra)].error_of(task, k))
            for words, extra in (("no dry friction", (_BARE,)), ("no friction at all", _UNDAMPED))
            for label, task, k, unit in (
                ("x", "position", 0, "m"),
                ("y", "position", 1, "m"),
                ("q1", "q1", 0, "deg"),
            )
        ),
        ("RT3, HQP: largest error of the EE", "m", _farthest(straight)),
        ("RT3, HQP: largest torque over its bound", "1", straight.figure("limits", "torque", "max_ratio")),
        (
            f"RT4, first {_EARLY:g} s: RMSE of x, N = 20 over N = 1",
            "1",
            twenty.error_of("position", 0, "rmse") / one.error_of("position", 0, "rmse"),
        ),
    ]
    return Section(rows=tuple(starmap(unprinted, rows)))


_AXES = ((0, "x"), (1, "y"))


def _farthest(run: JobResult) -> float:
    error = run["error/position"]
    return float(np.linalg.norm(error, axis=1).max()) if run.completed and len(error) else math.nan


# ------------------------------------------------------------------------ RT4 without HIMPC

_RIVALS = ("osf", "tdeosf", "hqp")


def _rivals(results: Results, quick: bool) -> Section:
    rows = []
    for controller in _RIVALS:
        run = results[rt4(controller)]
        share = run.figure("limits", "position", "max_ratio")
        rows.append(
            Row(
                f"{name(controller)} on RT4: the system is unstable",
                "✓",
                float(printed("himpc_text")["rt4_unstable"][controller]),
                math.nan if run.error is not None else float(run.lost_at is not None),
                trouble(run) or f"runs to its end; a joint moves to {number(share)} times its limit",
                turns_at=0.5,
                topic="rt4-rivals",
            )
        )
    run = results[rt4("tdeosf")]
    own = (
        ("TDEOSF on RT4: largest error of the TCP", "m", _farthest(run)),
        ("TDEOSF on RT4: position over its limit", "1", run.figure("limits", "position", "max_ratio")),
        ("HQP on RT4: control is lost at", "s", _lost(results[rt4("hqp")])),
        ("OSF on RT4: control is lost at", "s", _lost(results[rt4("osf")])),
    )
    return Section(
        rows=(*rows, *starmap(unprinted, own)),
    )


ITEMS = (
    described("himpc-conflict", _conflict_jobs, _conflict),
    described("himpc-rivals", tuple(map(rt4, _RIVALS)), _rivals),
    described("himpc-weights", (), _weights),
    described("himpc-settings", _settings_jobs, _settings),
)

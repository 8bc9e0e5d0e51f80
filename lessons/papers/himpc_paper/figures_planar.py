"""Figs. 3 to 15: section V over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lessons.experiments.drag import skeleton
from lessons.experiments.jobs import Job, JobResult, Results
from lessons.papers.curves import (
    PLANAR_ERRORS,
    banded,
    curve,
    error_panels,
    excerpt,
    joint_panels,
    log_error_panels,
)
from lessons.papers.himpc_paper.planar import COMPARED, ENCODER, level_1, roughness, rt1, rt2, rt3
from lessons.papers.item import Row, Section, Table
from lessons.papers.texts import described, drawn
from lessons.papers.words import number, stated, trouble, unprinted
from lessons.plots.panels import Bars, Panel, PlotCurve
from lessons.plots.style import name
from robots import load_robot
from robots.arrays import Array

DEG = 180 / np.pi
INCREMENTAL = ("tdeosf", "hiqp", "himpc")
CONFLICT = (rt2("hqp"), rt2("himpc"))


def encoder_runs(controllers: Sequence[str]) -> tuple[Job, ...]:
    """Returns the runs of RT1 with the paper's encoder, one per controller: the roughness of the torque
    differs between them."""
    return tuple(rt1(controller, *ENCODER) for controller in controllers)


def _runs(results: Results, jobs: Sequence[Job]) -> list[JobResult]:
    return [results[job] for job in jobs]


# ------------------------------------------------------------------------ Figs. 3 and 9: references


def _reference(run: JobResult, field: str, k: int, label: str, colour: str, scale: float = 1.0) -> PlotCurve:
    return curve(run, f"x_d/{field}", k, scale, label=label, colour=colour)


def _path(*runs: JobResult) -> Panel:
    curves = tuple(
        PlotCurve(run.column("x_d/position"), run.column("x_d/position", 1), colour="reference")
        for run in runs
    )
    return Panel("$y_d$ (m)", curves, "$x_d$ (m)", equal=True, title="EE")


def _fig_3(results: Results, quick: bool) -> Section:
    circle, conflict = results[rt1("himpc")], results[rt2("himpc")]
    panels = (
        _path(circle),
        Panel(
            "position (m)",
            (
                _reference(circle, "position", 0, "$x_d$", "0"),
                _reference(circle, "position", 1, "$y_d$", "1"),
            ),
        ),
        Panel(
            "$q_1$ (deg)",
            (
                _reference(circle, "q1", 0, "$q_{1,d1}$ (RT1)", "2", DEG),
                _reference(conflict, "q1", 0, "$q_{1,d2}$ (RT2)", "3", DEG),
            ),
        ),
    )
    return drawn("himpc-fig-3", panels, 3)


def _fig_9(results: Results, quick: bool) -> Section:
    run = results[rt3("himpc")]
    axes = (_reference(run, "position", 0, "$x_d$", "0"), _reference(run, "position", 1, "$y_d$", "1"))
    panels = (_path(run), Panel("position (m)", axes))
    return drawn("himpc-fig-9", panels, 2)


# ------------------------------------------------------------------------ Figs. 4 to 8: scenario 1


def _fig_4(results: Results, quick: bool) -> Section:
    runs = _runs(results, encoder_runs(COMPARED))
    return drawn("himpc-fig-4", log_error_panels(runs, PLANAR_ERRORS))


def _fig_5(results: Results, quick: bool) -> Section:
    runs = _runs(results, encoder_runs(INCREMENTAL))
    return drawn("himpc-fig-5", error_panels(runs, PLANAR_ERRORS))


def _torques(results: Results, number: int, controllers: tuple[str, str]) -> Section:
    runs = _runs(results, encoder_runs(controllers))
    first, second = (name(controller) for controller in controllers)
    whole = joint_panels(runs, "tau", r"\tau", "N·m")
    panels = tuple(part for panel in whole for part in (banded(panel), excerpt(panel, 2.5, 2.55)))
    row = stated(
        f"RMS of Δτ, {second}'s over {first}'s",
        roughness(runs[1]) / roughness(runs[0]),
        f"smoother_than_{controllers[0]}",
        "{says} 1 (smoother)",
        "smoothness",
    )
    return drawn(f"himpc-fig-{number}", panels, 2, rows=(row,))


def _fig_8(results: Results, quick: bool) -> Section:
    runs = _runs(results, encoder_runs(("himpc", "tdeosf", "hiqp")))
    costs = [tuple(run.figure("average_cost", level) for level in (0, 1)) for run in runs]
    series = tuple(
        (name(run.controller), run.controller, cost) for run, cost in zip(runs, costs, strict=True)
    )
    groups = ("level 1", "level 2")
    bars = Bars("$C_i$ (m²/s⁴, rad²/s⁴)", groups, series)
    apart = tuple(
        (label, key, tuple(100.0 * (c / h - 1.0) for c, h in zip(cost, costs[0], strict=True)))
        for label, key, cost in series[1:]
    )
    relative = Bars("over HIMPC's (%)", groups, apart)
    rows = tuple(
        (name(run.controller), *(number(value) for value in cost), trouble(run))
        for run, cost in zip(runs, costs, strict=True)
    )
    own, tdeosf, hiqp = costs
    compared = (
        *(
            stated(
                f"average cost of level {k + 1}, HIMPC's over the best rival's",
                own[k] / min(tdeosf[k], hiqp[k]),
                f"cheapest_on_level_{k + 1}",
                "HIMPC's is the lowest",
                "average-cost",
            )
            for k in (0, 1)
        ),
        stated(
            "average cost of level 2, HIQP's over TDEOSF's",
            hiqp[1] / tdeosf[1],
            "hiqp_dearer_than_tdeosf",
            "HIQP's is higher",
            "average-cost",
        ),
    )
    return drawn(
        "himpc-fig-8",
        (bars, relative),
        2,
        rows=compared,
        tables=(Table("Average cost (41)", ("controller", "level 1", "level 2", ""), rows),),
    )


def _fig_6(results: Results, quick: bool) -> Section:
    return _torques(results, 6, ("tdeosf", "himpc"))


def _fig_7(results: Results, quick: bool) -> Section:
    return _torques(results, 7, ("hiqp", "himpc"))


# ------------------------------------------------------------------------ Figs. 10 to 13: conflict


def _fig_10(results: Results, quick: bool) -> Section:
    runs = _runs(results, CONFLICT)
    return drawn("himpc-fig-10", error_panels(runs, PLANAR_ERRORS))


def _fig_11(results: Results, quick: bool) -> Section:
    panels, growth = [], {}
    for controller, size, words in (("hqp", 12.0, "±12 mm"), ("himpc", 1.2, "±1.2 mm: ten times enlarged")):
        circle, conflict = results[rt1(controller)], results[rt2(controller)]
        for k, axis in enumerate("xy"):
            curves = (
                curve(
                    conflict, "error/position", k, 1e3, label=f"{name(controller)}, RT2", colour=controller
                ),
                curve(circle, "error/position", k, 1e3, label="RT1", colour="reference", style="dashed"),
            )
            title = f"{name(controller)}, {words}" if k == 0 else ""
            panels.append(Panel(f"$e_{axis}$ (mm)", curves, title=title, y_range=(-size, size)))
        growth[controller] = level_1(conflict) / level_1(circle)
    ordered = (panels[0], panels[2], panels[1], panels[3])
    return drawn("himpc-fig-11", ordered, 2, rows=_growth_rows(results, growth))


def _growth_rows(results: Results, growth: dict[str, float]) -> tuple[Row, ...]:
    """Rows for the statements of the paper about the figure, which has no readable numbers."""
    lines = (
        ("HIMPC: level-1 RMSE in RT2 over RT1", growth["himpc"], "conflict_himpc", "nearly not affected"),
        ("HQP: level-1 RMSE in RT2 over RT1", growth["hqp"], "conflict_hqp", "deteriorates"),
        (
            "HIMPC's growth over HQP's",
            growth["himpc"] / growth["hqp"],
            "conflict_himpc_over_hqp",
            "the conflict hardly affects HIMPC, unlike HQP",
        ),
        (
            "RT2: level-1 RMSE, HIMPC's over HQP's",
            level_1(results[rt2("himpc")]) / level_1(results[rt2("hqp")]),
            "error_under_conflict",
            "HIMPC's is lower",
        ),
    )
    return tuple(stated(*line, topic="conflict-reaches-level-1") for line in lines)


_CHATTER = (0.5, 1.6)
"""Line widths of HQP and HIMPC: HQP's torque chatters, and a broad line would fill an area."""


def _fig_12(results: Results, quick: bool) -> Section:
    runs = _runs(results, CONFLICT)
    panels = joint_panels(runs, "tau_demand", r"\tau", "N·m", bound="tau_upper", weights=_CHATTER)
    return drawn("himpc-fig-12", panels)


def _fig_13(results: Results, quick: bool) -> Section:
    runs = _runs(results, CONFLICT)
    panels = joint_panels(runs, "v", r"\dot q", "deg/s", DEG, bound="v_limit", weights=_CHATTER)
    return drawn("himpc-fig-13", panels)


# ------------------------------------------------------------------------ Figs. 14 and 15: singularity

POSES = 19


def _time_beside(tip: Array, path: Array, t: float) -> tuple[float, float, str]:
    """Returns the position and text of a label with the time of a pose, outside the path."""
    outward = tip[:2] - path.mean(axis=0)
    x, y = tip[:2] + 0.045 * outward / (np.linalg.norm(outward) or 1.0) - (0.03, 0.015)
    return float(x), float(y), f"{t:.1f} s"


def _fig_14(results: Results, quick: bool) -> Section:
    run = results[rt3("himpc")]
    panels = []
    if len(run.t):
        robot = load_robot("planar3")
        ticks = np.linspace(0, len(run.t) - 1, POSES).round().astype(int)
        for title, chosen in (("0 to 8 s", ticks[:10]), ("8 to 16 s", ticks[9:])):
            chains = [(tick, skeleton(robot, run["q"][tick])) for tick in chosen]
            arms = tuple(
                PlotCurve(
                    points[:, 0],
                    points[:, 1],
                    label="HIMPC" if k == 0 else "",
                    colour="himpc",
                    weight=2.2 if k in (0, len(chains) - 1) else 1.0,
                )
                for k, (_, points) in enumerate(chains)
            )
            span = slice(chosen[0], chosen[-1] + 1)
            x_d = run["x_d/position"][span]
            path = PlotCurve(x_d[:, 0], x_d[:, 1], label="reference", colour="reference", style="dashed")
            # The last pose of a panel has no label; the second panel labels that of the first.
            notes = tuple(_time_beside(points[-1], x_d, float(run.t[tick])) for tick, points in chains[:-1])
            panels.append(Panel("y (m)", (*arms, path), "x (m)", equal=True, title=title, notes=notes))
    return drawn("himpc-fig-14", panels or (Panel("y (m)", ()),), 2, {"poses": POSES})


def _fig_15(results: Results, quick: bool) -> Section:
    run = results[rt3("himpc")]
    whole = [run.error_of("position", k, "rmse") for k in (0, 1)]
    panels = tuple(
        replace(panel, marks=(0.0, 8.0, 16.0), mark_label="straight and singular")
        for panel in error_panels([run], PLANAR_ERRORS)
    )
    why = trouble(run) or "the paper: a curve only"
    rows = (
        unprinted(f"HIMPC, {axis}: RMSE over the whole run", "m", x, why)
        for axis, x in zip("xy", whole, strict=True)
    )
    return drawn("himpc-fig-15", panels, rows=tuple(rows))


ITEMS = (
    described("himpc-fig-3", (rt1("himpc"), rt2("himpc")), _fig_3),
    described("himpc-fig-4", encoder_runs(COMPARED), _fig_4),
    described("himpc-fig-5", encoder_runs(INCREMENTAL), _fig_5),
    described("himpc-fig-6", encoder_runs(("tdeosf", "himpc")), _fig_6),
    described("himpc-fig-7", encoder_runs(("hiqp", "himpc")), _fig_7),
    described("himpc-fig-8", encoder_runs(("himpc", "tdeosf", "hiqp")), _fig_8),
    described("himpc-fig-9", (rt3("himpc"),), _fig_9),
    described("himpc-fig-10", CONFLICT, _fig_10),
    described("himpc-fig-11", (rt1("hqp"), rt1("himpc"), *CONFLICT), _fig_11),
    described("himpc-fig-12", CONFLICT, _fig_12),
    described("himpc-fig-13", CONFLICT, _fig_13),
    described("himpc-fig-14", (rt3("himpc"),), _fig_14),
    described("himpc-fig-15", (rt3("himpc"),), _fig_15),
)

"""Figs. 3 to 8: RT1 and RT2, and scenario 1 of section V over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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
from lessons.papers.himpc_paper.planar import COMPARED, ENCODER, SOURCE, roughness, rt1, rt2, rt3
from lessons.papers.item import Item, Row, Section, Table
from lessons.papers.printed import printed
from lessons.papers.words import number, trouble
from lessons.plots.panels import Bars, Panel, Picture, PlotCurve
from lessons.plots.style import name

DEG = 180 / np.pi
INCREMENTAL = ("tdeosf", "hiqp", "himpc")


def encoder_runs(controllers: Sequence[str]) -> tuple[Job, ...]:
    """Returns the runs of RT1 with the paper's encoder, one per controller: the roughness of the torque
    differs between them."""
    return tuple(rt1(controller, *ENCODER) for controller in controllers)


def _runs(results: Results, jobs: Sequence[Job]) -> list[JobResult]:
    return [results[job] for job in jobs]


def _picture(name: str, caption: str, panels: Sequence[Panel | Bars], columns: int = 1) -> Section:
    return Section(pictures=(Picture(name, caption, tuple(panels), columns),))


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
    note = "The paper's axes have no readable scale: centre, radius, time law and swings of q₁ are ours."
    found = _picture("himpc-fig-3", "RT1 and RT2: the EE's circle and the two references of q₁.", panels, 3)
    return Section(notes=(note,), pictures=found.pictures)


def _fig_9(results: Results, quick: bool) -> Section:
    run = results[rt3("himpc")]
    axes = (_reference(run, "position", 0, "$x_d$", "0"), _reference(run, "position", 1, "$y_d$", "1"))
    panels = (_path(run), Panel("position (m)", axes))
    caption = "RT3: two tangent circles; the arm is straight at 0 s, 8 s and 16 s."
    return _picture("himpc-fig-9", caption, panels, 2)


# ------------------------------------------------------------------------ Figs. 4 to 8: scenario 1


def _fig_4(results: Results, quick: bool) -> Section:
    runs = _runs(results, encoder_runs(COMPARED))
    caption = (
        "Size of the tracking errors on RT1 with the paper's encoder, the largest in every 50 ms. OSF and "
        "HQP coincide, and so do TDEOSF and HIMPC. Curves are cut off below 1e-4."
    )
    return _picture("himpc-fig-4", caption, log_error_panels(runs, PLANAR_ERRORS))


def _fig_5(results: Results, quick: bool) -> Section:
    runs = _runs(results, encoder_runs(INCREMENTAL))
    caption = "Tracking errors of the methods with time-delay estimation on RT1, paper's encoder."
    return _picture("himpc-fig-5", caption, error_panels(runs, PLANAR_ERRORS))


def _torques(results: Results, number: int, controllers: tuple[str, str]) -> Section:
    runs = _runs(results, encoder_runs(controllers))
    first, second = (name(controller) for controller in controllers)
    caption = (
        f"Torques of {first} and {second} on RT1 with the paper's encoder: the least and the largest value "
        "in every 50 ms, which are nearly the same for both; right: an excerpt of 50 ms."
    )
    whole = joint_panels(runs, "tau", r"\tau", "N·m")
    panels = tuple(each for panel in whole for each in (banded(panel), excerpt(panel, 2.5, 2.55)))
    picture = Picture(f"himpc-fig-{number}", caption, panels, 2)
    says = printed("himpc_text")[f"smoother_than_{controllers[0]}"]
    row = Row(
        f"RMS of Δτ, {second}'s over {first}'s",
        "1",
        None,
        roughness(runs[1]) / roughness(runs[0]),
        f"the paper says: {says} 1 (smoother)",
        turns_at=1.0,
        says=says,
        topic="smoothness",
    )
    return Section(rows=(row,), pictures=(picture,))


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
    beside = Bars("over HIMPC's (%)", groups, apart)
    rows = tuple(
        (name(run.controller), *(number(value) for value in cost), trouble(run))
        for run, cost in zip(runs, costs, strict=True)
    )
    own, tdeosf, hiqp = costs
    says = printed("himpc_text")
    compared = (
        *(
            Row(
                f"average cost of level {k + 1}, HIMPC's over the best rival's",
                "1",
                None,
                own[k] / min(tdeosf[k], hiqp[k]),
                "the paper says: HIMPC's is the lowest",
                turns_at=1.0,
                says=says[f"cheapest_on_level_{k + 1}"],
                topic="average-cost",
            )
            for k in (0, 1)
        ),
        Row(
            "average cost of level 2, HIQP's over TDEOSF's",
            "1",
            None,
            hiqp[1] / tdeosf[1],
            "the paper says: HIQP's is higher",
            turns_at=1.0,
            says=says["hiqp_dearer_than_tdeosf"],
            topic="average-cost",
        ),
    )
    return Section(
        notes=(
            "The cost (41), with e from measurements that are differentiated numerically. With an encoder, e "
            "is mostly noise, which is nearly the same for all controllers.",
        ),
        rows=compared,
        tables=(Table("Average cost (41)", ("controller", "level 1", "level 2", ""), rows),),
        pictures=(Picture("himpc-fig-8", "Average cost (41) on RT1, paper's encoder.", (bars, beside), 2),),
    )


_S1, _S2 = f"{SOURCE}-B", f"{SOURCE}-C"
ITEMS = (
    Item("himpc-fig-3", "RT1 and RT2", f"{_S1}, Fig. 3", lambda _: (rt1("himpc"), rt2("himpc")), _fig_3),
    Item(
        "himpc-fig-4", "Errors, four controllers", f"{_S1}, Fig. 4", lambda _: encoder_runs(COMPARED), _fig_4
    ),
    Item("himpc-fig-5", "Errors with TDE", f"{_S1}, Fig. 5", lambda _: encoder_runs(INCREMENTAL), _fig_5),
    Item(
        "himpc-fig-6",
        "Torques of TDEOSF and HIMPC",
        f"{_S1}, Fig. 6",
        lambda _: encoder_runs(("tdeosf", "himpc")),
        lambda results, _: _torques(results, 6, ("tdeosf", "himpc")),
    ),
    Item(
        "himpc-fig-7",
        "Torques of HIQP and HIMPC",
        f"{_S1}, Fig. 7",
        lambda _: encoder_runs(("hiqp", "himpc")),
        lambda results, _: _torques(results, 7, ("hiqp", "himpc")),
    ),
    Item(
        "himpc-fig-8",
        "Average cost",
        f"{_S1}, Fig. 8 and (41)",
        lambda _: encoder_runs(("himpc", "tdeosf", "hiqp")),
        _fig_8,
    ),
    Item("himpc-fig-9", "RT3", f"{_S2}, Fig. 9", lambda _: (rt3("himpc"),), _fig_9),
)

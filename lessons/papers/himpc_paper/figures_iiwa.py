"""Figs. 17 to 21, the iiwa over time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from himpc.constants import AT_POSITION
from lessons.experiments.jobs import Job, Results
from lessons.papers.curves import banded, by_controller, curve, excerpt, spans
from lessons.papers.himpc_paper.iiwa import (
    horizon_job,
    horizons,
    resolution_job,
    rt4,
    smoothness,
    step_seconds,
    timed,
)
from lessons.papers.item import Section, Table
from lessons.papers.texts import described, drawn
from lessons.papers.words import number, printed, trouble
from lessons.plots.panels import Bars, Panel

DEG = 180 / np.pi


def _fig_17(results: Results, quick: bool) -> Section:
    run = results[rt4()]
    bits = np.nan_to_num(run["at_bound"]).astype(int)
    active = spans(run.t, (bits & AT_POSITION != 0).any(axis=1)) if len(run.t) else ()
    panels = tuple(
        Panel(
            label,
            tuple(
                curve(run, f"error/{task}", k, scale, label=axis, colour=str(colour + k))
                for k, axis in enumerate(axes)
            ),
            spans=active,
            span_label="a joint at its position limit",
        )
        for task, label, axes, scale, colour in (
            ("position", "error of level 1 (mm)", ("x", "y", "z"), 1e3, 0),
            ("orientation", "error of level 2 (deg)", ("$o_X$", "$o_Y$", "$o_Z$"), DEG, 3),
            ("q1", "error of level 3 (deg)", ("$q_1$",), DEG, 6),
        )
    )
    return drawn("himpc-fig-17", panels)


def _fig_18_jobs(quick: bool) -> tuple[Job, ...]:
    return tuple(horizon_job("himpc", N, (), quick) for N in horizons("himpc", quick))


def _fig_18(results: Results, quick: bool) -> Section:
    curves = tuple(
        curve(results[job], "error/position", 0, 1e3, label=f"N = {N}", colour=str(k))
        for k, (job, N) in enumerate(zip(_fig_18_jobs(quick), horizons("himpc", quick), strict=True))
    )
    return drawn("himpc-fig-18", (Panel("$e_x$ (mm)", curves),))


def _fig_19_horizons(quick: bool) -> tuple[int, ...]:
    return tuple(N for N in horizons("nhimpc", quick) if N <= 20)


def _fig_19_jobs(quick: bool) -> tuple[Job, ...]:
    return tuple(
        horizon_job(controller, N, (), quick)
        for N in _fig_19_horizons(quick)
        for controller in ("himpc", "nhimpc")
    )


def _fig_19(results: Results, quick: bool) -> Section:
    panels = []
    for N in _fig_19_horizons(quick):
        runs = [results[horizon_job(controller, N, (), quick)] for controller in ("himpc", "nhimpc")]
        curves = by_controller(runs, "error/position", 0, 1e3)
        panels.append(Panel("$e_x$ (mm)", curves, title=f"N = {N}"))
    return drawn("himpc-fig-19", panels)


def _fig_20_horizons(quick: bool) -> tuple[int, ...]:
    return (5, 10, 20) if quick else (5, 10, 15, 20, 25, 30)


def _fig_20(results: Results, quick: bool) -> Section:
    Ns = _fig_20_horizons(quick)
    runs = [results[timed("himpc", N, quick)] for N in Ns]
    average = tuple(1e3 * step_seconds(run)["average"] for run in runs)
    bars = Bars("average step time (ms)", tuple(map(str, Ns)), (("HIMPC", "himpc", average),), "horizon N")
    rows = tuple(
        (str(N), number(value), trouble(run)) for N, value, run in zip(Ns, average, runs, strict=True)
    )
    return drawn("himpc-fig-20", (bars,), tables=(Table("Average step time (ms)", ("N", "ours", ""), rows),))


def _fig_21_jobs(quick: bool) -> tuple[Job, ...]:
    return tuple(
        resolution_job(resolution, quick) for resolution in (printed("himpc_table_8")["benchmark"], 5)
    )


def _fig_21(results: Results, quick: bool) -> Section:
    benchmark, coarse = (results[job] for job in _fig_21_jobs(quick))
    curves = (
        curve(coarse, "tau", 0, label="5e-3°", colour="1"),
        curve(benchmark, "tau", 0, label="1e-5° (benchmark)", colour="0"),
    )
    whole = Panel(r"$\tau_1$ (N·m)", curves)
    panels = (
        replace(banded(whole), title="least and largest value in every 50 ms"),
        replace(excerpt(whole, 1.0, 1.05), title="an excerpt of 50 ms"),
    )
    S = number(smoothness(coarse, benchmark))
    return drawn("himpc-fig-21", panels, 2, {"S": S})


ITEMS = (
    described("himpc-fig-17", (rt4(),), _fig_17),
    described("himpc-fig-18", _fig_18_jobs, _fig_18),
    described("himpc-fig-19", _fig_19_jobs, _fig_19),
    described(
        "himpc-fig-20",
        lambda quick: tuple(timed("himpc", N, quick) for N in _fig_20_horizons(quick)),
        _fig_20,
    ),
    described("himpc-fig-21", _fig_21_jobs, _fig_21),
)

"""Table VII: computing time."""

from __future__ import annotations

import math

import numpy as np

from lessons.experiments.jobs import Job, JobResult, Results
from lessons.papers.himpc_paper.iiwa import RT4, SOURCE
from lessons.papers.item import Item, Row, Section, Table, between
from lessons.papers.words import number, printed, trouble
from lessons.plots.style import name
from lessons.scenes.run_spec import RunSpec


def timed(controller: str, N: int, quick: bool) -> Job:
    """Returns the run of RT4 for step times: half a second, alone on the machine."""
    return Job(
        RunSpec(RT4, controller=controller, set=(f"horizon={N}",), duration=0.2 if quick else 0.5), timed=True
    )


def step_seconds(run: JobResult) -> dict[str, float]:
    """Average, median and maximum step time, s, without the first ten steps. NaN for a failed run."""
    times = 1e-6 * run.column("step_us")[10:]
    if not len(times):
        return dict.fromkeys(("average", "median", "maximum"), math.nan)
    return {
        "average": float(times.mean()),
        "median": float(np.median(times)),
        "maximum": float(times.max()),
    }


def _table_7(results: Results, quick: bool) -> Section:
    paper = printed("himpc_table_7")
    ours = {
        controller: step_seconds(results[timed(controller, 5, quick)]) for controller in ("himpc", "nhimpc")
    }
    rows = [
        Row(
            f"{name(controller)}, {kind}",
            "s",
            paper[controller][kind],
            ours[controller][kind],
            trouble(results[timed(controller, 5, quick)])
            or "another machine, and a compiled active-set method instead of qpOASES or CasADi's SQP",
            band=MACHINE,
            topic="computing-time",
        )
        for controller in ("himpc", "nhimpc")
        for kind in ("average", "median", "maximum")
    ]
    for kind in ("average", "median"):
        rows.append(
            Row(
                f"NHIMPC over HIMPC, {kind}",
                "1",
                paper["nhimpc"][kind] / paper["himpc"][kind],
                ours["nhimpc"][kind] / ours["himpc"][kind],
                "the ratio is that of our two implementations: SQP through the same QP solver, warm-started",
                turns_at=1.0,
                band=0.8,
                topic="computing-time",
            )
        )
    runs = [results[timed(controller, 5, quick)] for controller in ("himpc", "nhimpc")]
    table = Table(
        "Iterations per step (solutions of all levels)",
        ("controller", "mean", "largest"),
        tuple(
            (
                name(run.controller),
                *(number(run.figure("solver", "iterations", kind)) for kind in ("mean", "max")),
            )
            for run in runs
        ),
    )
    return Section(
        notes=("Step times from state in to torque out, N = 5, while no other job of ours runs.",),
        rows=tuple(rows),
        tables=(table,),
        checks=(
            between("NHIMPC's median time over HIMPC's", rows[-1].ours, 1.2, 6.0, band=None),
            between("NHIMPC's SQP iterations per step and level, mean", *_iterations(runs[1]), band=0.2),
        ),
    )


MACHINE = 9.0
"""Factor by which a time may be longer or shorter on another machine, or on this one under load."""


def _iterations(run: JobResult) -> tuple[float, float, float]:
    return run.figure("solver", "iterations", "mean"), 1.5, 3.5


ITEMS = (
    Item(
        "himpc-table-7",
        "Computing time with N = 5",
        f"{SOURCE}-C, Table VII",
        lambda quick: tuple(timed(controller, 5, quick) for controller in ("himpc", "nhimpc")),
        _table_7,
    ),
)

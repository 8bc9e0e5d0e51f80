"""Table VIII: smoothness of the torque against the encoders' resolution."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from lessons.experiments.jobs import Job, JobResult, Results
from lessons.papers.himpc_paper.iiwa import SOURCE, rt4
from lessons.papers.item import Item, PaperCheck, Row, Section, between
from lessons.papers.words import printed, trouble

_FREE = ("limits.position=off",)
"""Settings without state bounds: an active bound would hide the sensor noise, which Table VIII measures."""


def resolution_job(thousandths: float, quick: bool = False) -> Job:
    """Returns the run of RT4 with encoders of a resolution in 1e-3 deg; no state bound is active."""
    extra = (*_FREE, f"plant.encoder_resolution_deg={thousandths * 1e-3:g}")
    return rt4("himpc", *extra, seconds=2.0 if quick else None)


def _jobs(quick: bool) -> tuple[Job, ...]:
    paper = printed("himpc_table_8")
    return tuple(
        resolution_job(resolution, quick) for resolution in (paper["benchmark"], *paper["resolution"])
    )


def smoothness(run: JobResult, benchmark: JobResult) -> float:
    """S of section VI-D: the RMS of ‖τ − τ of the benchmark‖, N·m, over the time that both ran."""
    ticks = min(len(run.t), len(benchmark.t))
    if not ticks:
        return math.nan
    difference = run["tau"][:ticks] - benchmark["tau"][:ticks]
    return float(np.sqrt((difference**2).sum(axis=1).mean()))


def _section(results: Results, quick: bool) -> Section:
    paper = printed("himpc_table_8")
    benchmark = results[resolution_job(paper["benchmark"], quick)]
    runs = [results[resolution_job(resolution, quick)] for resolution in paper["resolution"]]
    measured = [smoothness(run, benchmark) for run in runs]
    rows = tuple(
        Row(
            f"S at {resolution:g}e-3° (benchmark {paper['benchmark']:g}e-3°)",
            "N·m",
            value,
            ours,
            trouble(results[resolution_job(resolution, quick)])
            or "scales with M̄ and the sensor model, and the paper does not say how it gets q̇ from q",
            topic="chatter",
        )
        for resolution, value, ours in zip(paper["resolution"], paper["smoothness"], measured, strict=True)
    )
    rising = float(np.min([b - a for a, b in pairwise(measured)]))
    worst = max(abs(row.ratio - 1) if row.ratio else math.inf for row in rows)
    return Section(
        notes=(
            "q̇ is the backward difference of the quantised q. Position and velocity limits are off: no "
            f"state bound clips the chatter. The benchmark has {paper['benchmark']:g}e-3°.",
        ),
        rows=rows,
        checks=(
            PaperCheck(
                "S strictly increases with the resolution: least difference (N·m) above 0", rising, rising > 0
            ),
            between("largest deviation of S from the paper's, as a share", worst, 0.05, 0.3),
        ),
    )


ITEMS = (Item("himpc-table-8", "Smoothness over the resolution", f"{SOURCE}-D, Table VIII", _jobs, _section),)

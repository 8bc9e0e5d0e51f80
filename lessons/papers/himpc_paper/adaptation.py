"""Not in the paper: M̄ that looks after itself (`himpc.adaptation`), under payloads that nobody told of."""

from __future__ import annotations

import math

from lessons.experiments.jobs import Job, Results, Run
from lessons.papers.himpc_paper.iiwa import RT4_DATA_SHEET
from lessons.papers.item import Item, Row, Section
from lessons.papers.words import trouble
from lessons.scenes.run_spec import RunSpec

_ADAPTED = "M_bar_adapt=true"
_SETTINGS = {"as set": (), _ADAPTED: (_ADAPTED,)}
CASES = (
    *(("himpc", payload) for payload in (0.0, 0.5, 2.0, 4.0)),
    ("hiqp", 4.0),
    ("weighted", 2.0),
)
"""(controller, payload in kg)."""


def _job(controller: str, payload: float, extra: tuple[str, ...]) -> Job:
    load = () if payload == 0.0 else (f"plant.payload_kg={payload:g}",)
    return Job(RunSpec(RT4_DATA_SHEET, controller=controller, set=(*load, *extra)))


def _jobs(quick: bool) -> tuple[Job, ...]:
    return () if quick else tuple(_job(*case, extra) for case in CASES for extra in _SETTINGS.values())


def distance(run: Run) -> float:
    """RMS distance of the TCP from its path after the first second, m; NaN for a run that failed."""
    return math.hypot(*(run.error_of("position", k) for k in range(3)))


def _section(results: Results, quick: bool) -> Section:
    if quick:
        return Section(notes=("Only in the whole version.",))
    rows = []
    for controller, payload in CASES:
        for words, extra in _SETTINGS.items():
            run = results[_job(controller, payload, extra)]
            quantity = f"{controller}, {payload:g} kg, {words}: RMS distance of the TCP after 1 s"
            why = trouble(run) or "not in the paper"
            rows.append(Row(quantity, "mm", None, 1e3 * distance(run), why))
    return Section(rows=tuple(rows))


ITEMS = (
    Item("himpc-adaptation", "M̄ that looks after itself", "not in the paper; Remark 4", _jobs, _section),
)

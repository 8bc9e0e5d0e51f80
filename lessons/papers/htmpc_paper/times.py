"""Compute times of the control step."""

from __future__ import annotations

from dataclasses import replace

from lessons.experiments.jobs import Job, Results
from lessons.papers.htmpc_paper.runs import METHODS, example
from lessons.papers.item import Row, Section
from lessons.papers.texts import described
from lessons.papers.words import printed, trouble
from lessons.scenes.run_spec import RunSpec

_WHY = "another machine and another solver (the paper: CasADi and Gurobi)"


def _cases() -> dict[str, Job]:
    cases: dict[str, Job] = {words: replace(example(c), timed=True) for c, words in METHODS.items()}
    cases["HTMPC with obstacles"] = Job(
        RunSpec("ridgeback-ur10-cluttered", controller="htmpc", duration=8.0), timed=True
    )
    return cases


def _report(results: Results, quick: bool) -> Section:
    text = printed("htmpc_text")
    paper = {"HTMPC": text["htmpc_step_ms"], "HTIDKC": text["htidkc_step_ms"]}
    rows = []
    for words, job in _cases().items():
        run = results[job]
        for key, printed_value in (("median", paper.get(words)), ("p99", None)):
            ours = run.figure("step_ms", key)
            why = trouble(run) or _WHY
            quantity = f"{words}: {key} of the step"
            rows.append(Row(quantity, "ms", printed_value, ours, why, band=9.0, topic="computing-time"))
    return Section(rows=tuple(rows))


ITEMS = (described("htmpc-times", tuple(_cases().values()), _report),)

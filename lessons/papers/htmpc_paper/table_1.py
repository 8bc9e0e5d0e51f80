"""Table I and Fig. 5: the two lexicographic constraints with two tolerances."""

from __future__ import annotations

from lessons.experiments.jobs import Job, Results
from lessons.papers.htmpc_paper.runs import SOURCE, example, hand_mm, normalised
from lessons.papers.item import Check, Item, Row, Section, Table
from lessons.papers.printed import printed
from lessons.papers.words import number, trouble
from lessons.plots.panels import Curve, Panel, Picture

EQUATIONS = {"cost": "(11)", "per_coordinate": "(12)"}
LETTERS = {"paper": "A", "proximal": "C"}
DELTAS = {"low": 0.001, "high": 0.01}
FORMULATIONS = {"paper": "A, as printed", "proximal": "C, the default"}
_WHY = {
    "paper": "the paper does not print its peak target, nor all its weights, and the numbers hang on them",
    "proximal": "not the paper's formulation: upper levels keep to their plan, so the hand hardly moves",
}


def _job(formulation: str, equation: str, tolerance: str) -> Job:
    return example(
        "htmpc",
        f"formulation={formulation}",
        f"lexicographic={equation}",
        f"delta_m={DELTAS[tolerance]}",
    )


_CASES = [(f, e, d) for f in FORMULATIONS for e in EQUATIONS for d in DELTAS]


def _jobs(quick: bool) -> tuple[Job, ...]:
    return tuple(_job(*case) for case in _CASES)


def _table(results: Results, quick: bool) -> Section:
    paper = printed("htmpc_table_1")
    rows, lines = [], []
    for f, e, d in _CASES:
        run = results[_job(f, e, d)]
        mean, std, largest = hand_mm(run)
        label = f"{EQUATIONS[e]}, {d} δ, formulation {LETTERS[f]}"
        for words, ours in (("avg", mean), ("std", std)):
            why = trouble(run) or _WHY[f]
            rows.append(Row(f"{label}: {words} of the EE error", "mm", paper[e][d][words], ours, why))
        parts = [run.figure("parts", k, "normalised_base_error") for k in (0, 1)]
        zero = run.figure("line_search", "zero_share")
        step = run.figure("line_search", "mean_step")
        lines.append((label, *(number(x) for x in (largest, *parts, step, zero))))
    checks = []
    for f in FORMULATIONS:
        for d in DELTAS:
            first = {e: results[_job(f, e, d)].figure("parts", 0, "normalised_base_error") for e in EQUATIONS}
            gain = first["cost"] - first["per_coordinate"]
            checks.append(Check(f"Part 1: (12) beats (11), {d} δ, formulation {LETTERS[f]}", gain, gain > 0))
    columns = (
        "constraint",
        "EE max (mm)",
        "base, Part 1",
        "base, Part 2",
        "mean step",
        "share of zero steps",
    )
    notes = (
        "EE error on one square wave. Formulation A takes the paper's weights literally; the default C "
        "charges upper levels for leaving the shifted previous plan and keeps limits as hard rows.",
    )
    return Section(notes, tuple(rows), (Table("Beside it", columns, tuple(lines)),), tuple(checks))


def _fig_5(results: Results, quick: bool) -> Section:
    panels = []
    for f, words in FORMULATIONS.items():
        curves = []
        for place, (e, d) in enumerate((e, d) for e in EQUATIONS for d in DELTAS):
            run = results[_job(f, e, d)]
            curves.append(Curve(run.t, normalised(run), f"{EQUATIONS[e]}, {d} δ", str(place)))
        panels.append(Panel("base error (1)", tuple(curves), title=f"formulation {words}", bounds=(0.05,)))
    caption = "Base error over its value at the start of each part, with the 5 % bound of the paper's Fig. 5."
    return Section(pictures=(Picture("htmpc-fig-5", caption, tuple(panels), 2),))


ITEMS = (
    Item("htmpc-table-1", "EE error under (11) and (12)", f"{SOURCE}-B, Table I", _jobs, _table),
    Item("htmpc-fig-5", "Base error under (11) and (12)", f"{SOURCE}-B, Fig. 5", _jobs, _fig_5),
)

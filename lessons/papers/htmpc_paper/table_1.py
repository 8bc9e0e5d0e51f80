"""Table I and Fig. 5: the two lexicographic constraints with two tolerances."""

from __future__ import annotations

from lessons.experiments.jobs import Job, Results
from lessons.papers.htmpc_paper.runs import example, hand_mm, normalised
from lessons.papers.item import PaperCheck, Row, Section, Table, between
from lessons.papers.texts import described, drawn
from lessons.papers.words import number, printed, trouble, unprinted
from lessons.plots.panels import Panel, PlotCurve

EQUATIONS = {"cost": "(11)", "per_coordinate": "(12)"}
LETTERS = {"paper": "A", "proximal": "C"}
DELTAS = {"low": 0.001, "high": 0.01}
FORMULATIONS = {"paper": "A, as printed", "proximal": "C, the default"}
_TOPIC = {"paper": "hand-under-11-and-12", "proximal": "proximal-hand"}
_WHY = {
    "paper": "the numbers depend on the peak target and on weights that the paper does not print",
    "proximal": "not the paper's formulation: upper levels keep to their plan",
}


_OWN = ("formulation=proximal", "lexicographic=per_coordinate", "delta_m=0.01")


def _job(formulation: str, equation: str, tolerance: str) -> Job:
    assignments = (f"formulation={formulation}", f"lexicographic={equation}", f"delta_m={DELTAS[tolerance]}")
    # The scene's own settings are not assigned, so that this is the same run as the example of Figs. 3 and 4.
    return example("htmpc", *(() if assignments == _OWN else assignments))


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
            quantity = f"{label}: {words} of the EE error"
            rows.append(Row(quantity, "mm", paper[e][d][words], ours, why, topic=_TOPIC[f]))
        parts = [run.figure("parts", k, "normalised_base_error") for k in (0, 1)]
        rows.append(unprinted(f"{label}: base error, Part 2", "1", parts[1], "Fig. 5 shows curves only"))
        zero = run.figure("line_search", "zero_share")
        step = run.figure("line_search", "mean_step")
        lines.append((label, *(number(x) for x in (largest, *parts, step, zero))))
    rows += [_order(results, f, d) for f in FORMULATIONS for d in DELTAS]
    columns = (
        "constraint",
        "EE max (mm)",
        "base, Part 1",
        "base, Part 2",
        "mean step",
        "share of zero steps",
    )
    table = Table("The base error and the line search", columns, tuple(lines))
    return Section(rows=tuple(rows), tables=(table,))


def _order(results: Results, f: str, d: str) -> Row:
    """Returns the row with the table's subject: the ratio of the hand's error with (12) to that with (11)."""
    paper = printed("htmpc_table_1")
    mean = {e: hand_mm(results[_job(f, e, d)])[0] for e in EQUATIONS}
    return Row(
        f"EE error with (12) over that with (11), {d} δ, formulation {LETTERS[f]}",
        "1",
        paper["per_coordinate"][d]["avg"] / paper["cost"][d]["avg"],
        mean["per_coordinate"] / mean["cost"],
        _WHY[f],
        turns_at=1.0,
        topic=_TOPIC[f],
    )


def _base_checks(results: Results) -> tuple[PaperCheck, ...]:
    """Fig. 5: the base's error in Part 1 under (11), minus that under (12)."""
    checks = []
    for f in FORMULATIONS:
        for d in DELTAS:
            first = {e: results[_job(f, e, d)].figure("parts", 0, "normalised_base_error") for e in EQUATIONS}
            gain = first["cost"] - first["per_coordinate"]
            text = f"base, Part 1: (11) less (12), {d} δ, formulation {LETTERS[f]}"
            checks.append(between(text, gain, 1e-3, 1.0))
    return tuple(checks)


def _fig_5(results: Results, quick: bool) -> Section:
    panels = []
    for f, words in FORMULATIONS.items():
        curves = []
        for index, (e, d) in enumerate((e, d) for e in EQUATIONS for d in DELTAS):
            run = results[_job(f, e, d)]
            curves.append(PlotCurve(run.t, normalised(run), f"{EQUATIONS[e]}, {d} δ", str(index)))
        panels.append(
            Panel(
                "base error (1)",
                tuple(curves),
                title=f"formulation {words}",
                bounds=(0.05,),
                bound_label="5 %",
                log_y=True,
                y_range=(1e-3, 1.5),
            )
        )
    return drawn("htmpc-fig-5", panels, 2, checks=_base_checks(results))


ITEMS = (described("htmpc-table-1", _jobs, _table), described("htmpc-fig-5", _jobs, _fig_5))

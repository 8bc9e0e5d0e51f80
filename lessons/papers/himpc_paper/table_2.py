"""Tables I and II: gains of the planar arm, RMSE on RT1."""

from __future__ import annotations

from lessons.experiments.jobs import Job, Results
from lessons.papers.himpc_paper.planar import (
    COMPARED,
    COORDINATES,
    ENCODER,
    RT1,
    SOURCE,
    level_1,
    roughness,
    rt1,
)
from lessons.papers.item import Item, Row, Section, Table, between
from lessons.papers.words import gain_rows, number, printed, trouble
from lessons.plots.style import name


def _table_1(results: Results, quick: bool) -> Section:
    return Section(
        notes=("The gains that the scene uses, read from it.",),
        rows=gain_rows(RT1, printed("himpc_table_1")),
    )


def _table_2_jobs(quick: bool) -> tuple[Job, ...]:
    return tuple(rt1(controller, *extra) for extra in ((), ENCODER) for controller in COMPARED)


def _table_2(results: Results, quick: bool) -> Section:
    paper = printed("himpc_table_2")
    rows = [
        Row(
            f"{name(controller)}, {label}",
            unit,
            paper[controller][label],
            results[rt1(controller)].error_of(task, k),
            trouble(results[rt1(controller)]) or _why_table_2(controller, label),
            topic="nominal-model" if controller in _WITH_MODEL else "planar-arm",
        )
        for controller in COMPARED
        for label, task, k, unit in COORDINATES
    ]
    rows += [
        _over_himpc(results, controller, *where) for controller in COMPARED[:-1] for where in COORDINATES
    ]
    himpc, tdeosf = results[rt1("himpc")], results[rt1("tdeosf")]
    best = level_1(himpc)
    checks = [
        *(
            between(f"{name(c)}: level-1 RMSE (m)", level_1(results[rt1(c)]), 1e-5, 1e-4)
            for c in ("himpc", "tdeosf")
        ),
        *(
            between(f"{name(run.controller)}: RMSE of q₁ (deg)", run.error_of("q1"), 1e-3, 0.05)
            for run in (himpc, tdeosf)
        ),
        *(
            between(f"{name(c)}: level-1 RMSE over HIMPC's", level_1(results[rt1(c)]) / best, 20, 200)
            for c in ("osf", "hqp")
        ),
    ]
    noisy = {controller: results[rt1(controller, *ENCODER)] for controller in COMPARED}
    return Section(
        notes=(
            "RMSE after the first second of RT1. The paper's numbers are measured on its own arm, whose "
            "masses, friction and model errors it does not print. Ours are simulated on `planar3` with a "
            "nominal model that is 20 % too light and contains no friction. Only magnitudes and ratios "
            "between controllers can be compared.",
        ),
        rows=tuple(rows),
        tables=(
            _whole_run(results),
            Table(
                "With the paper's encoder (1.25e-3°, velocity by difference)",
                ("controller", "x (m)", "y (m)", "q₁ (deg)", "RMS of Δτ (N·m)", "the same, ideal sensors"),
                tuple(
                    (
                        name(controller),
                        *(number(run.error_of(task, k)) for _, task, k, _ in COORDINATES),
                        number(roughness(run)),
                        number(roughness(results[rt1(controller)])),
                    )
                    for controller, run in noisy.items()
                ),
            ),
        ),
        checks=tuple(checks),
    )


_WITH_MODEL = ("osf", "hqp")


def _over_himpc(results: Results, controller: str, label: str, task: str, k: int, unit: str) -> Row:
    """Returns the error of a controller over HIMPC's: this ratio can be compared between different arms."""
    paper = printed("himpc_table_2")
    return Row(
        f"{name(controller)} over HIMPC, {label}",
        "1",
        paper[controller][label] / paper["himpc"][label],
        results[rt1(controller)].error_of(task, k) / results[rt1("himpc")].error_of(task, k),
        trouble(results[rt1(controller)]) or _why_table_2(controller, label),
        turns_at=1.0,
        topic="nominal-model" if controller in _WITH_MODEL else "tdeosf-and-himpc",
    )


def _why_table_2(controller: str, label: str) -> str:
    if controller in _WITH_MODEL:
        return "scales with the error of the nominal model and with friction, which the paper does not print"
    if label == "q1":
        return "the paper's swing of q₁ and its friction at joint 1 are not printed"
    return "the paper's arm has sensor noise and unknown friction; ours has ideal sensors here"


def _whole_run(results: Results) -> Table:
    return Table(
        "RMSE over the whole run, first second included",
        ("controller", "x (m)", "y (m)", "q₁ (deg)"),
        tuple(
            (
                name(controller),
                *(
                    number(results[rt1(controller)].error_of(task, k, "rmse"))
                    for _, task, k, _ in COORDINATES
                ),
            )
            for controller in COMPARED
        ),
    )


ITEMS = (
    Item("himpc-table-1", "Gains of the planar arm", f"{SOURCE}-A, Table I", lambda quick: (), _table_1),
    Item("himpc-table-2", "RMSE on RT1, four controllers", f"{SOURCE}-B, Table II", _table_2_jobs, _table_2),
)

"""Table III: properties of the controllers, decided from runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from lessons.experiments.jobs import Job, Results, Run
from lessons.papers.himpc_paper.planar import (
    COMPARED,
    SOURCE,
    largest_error,
    level_1,
    rt1,
    rt2,
    rt3,
    whole_run,
)
from lessons.papers.item import Check, Item, Section, Table, at_most
from lessons.papers.printed import printed
from lessons.papers.words import number, trouble
from lessons.plots.style import name

ACCURATE = 5e-4
"""m: between the paper's 9e-5 (✓) and 3e-3 (✗)."""
LOST_LEVEL_1 = 0.03
"""m: a level-1 error above this means that level 1 was lost."""
LOST_TORQUE = 4.0
"""A torque demand above this many times the bound means the same."""

CRITERIA = {
    "High accuracy": f"RT1, nominal model 20 % off: RMSE of x and of y after 1 s at most {ACCURATE:g} m",
    "Singularity-free": "RT2 and RT3 run to their end with the EE never more than "
    f"{LOST_LEVEL_1 * 100:g} cm off and the torque demand never above {LOST_TORQUE:g} times its bound",
    "Input constraints": "RT2: torque demand at most 1.001 times its bound",
    "State constraints": "RT2: joint speed at most 1.05 times its bound",
}


@dataclass(frozen=True)
class Verdict:
    """Whether a property holds, None if a run it needs failed, and the numbers that decided it."""

    holds: bool | None
    numbers: str

    @property
    def tick(self) -> str:
        """✓, ✗ or –."""
        return {True: "✓", False: "✗", None: "–"}[self.holds]


def verdicts(results: Results, controller: str) -> dict[str, Verdict]:
    """The verdict on each property."""
    circle, conflict, singular = (results[make(controller)] for make in (rt1, rt2, rt3))
    accuracy, speed = level_1(circle), conflict.figure("limits", "velocity", "max_ratio")
    rough = (conflict, singular)
    errors = [largest_error(run) for run in rough]
    demands = [run.figure("limits", "torque", "max_ratio") for run in rough]
    through = max(errors) <= LOST_LEVEL_1 and max(demands) <= LOST_TORQUE
    words = [f"{_distance(e)}, {number(d)} × torque" for e, d in zip(errors, demands, strict=True)]
    return {
        "High accuracy": _verdict([circle], accuracy <= ACCURATE, f"{number(accuracy)} m"),
        "Singularity-free": _verdict(rough, through, f"RT2 {words[0]}; RT3 {words[1]}"),
        "Input constraints": _verdict([conflict], demands[0] <= 1.001, f"{number(demands[0])} × bound"),
        "State constraints": _verdict([conflict], speed <= 1.05, f"{number(speed)} × bound"),
    }


def _verdict(runs: Sequence[Run], holds: bool, numbers: str) -> Verdict:
    failed = next((run.error for run in runs if run.error is not None), None)
    return Verdict(bool(holds), numbers) if failed is None else Verdict(None, failed)


def _distance(error: float) -> str:
    return "lost" if math.isinf(error) else f"{number(100 * error)} cm"


def _jobs(quick: bool) -> tuple[Job, ...]:
    return tuple(make(controller) for make in (rt1, rt2, rt3) for controller in COMPARED)


def _section(results: Results, quick: bool) -> Section:
    paper = printed("himpc_table_3")
    found = {controller: verdicts(results, controller) for controller in COMPARED}
    rows = [
        (
            criterion,
            name(controller),
            "✓" if paper[criterion][controller] else "✗",
            found[controller][criterion].tick,
            found[controller][criterion].numbers,
            _agreement(paper[criterion][controller], found[controller][criterion].holds, criterion),
        )
        for criterion in CRITERIA
        for controller in COMPARED
    ]
    own = found["himpc"]
    return Section(
        notes=(
            "Each ✓ or ✗ of ours is decided by a criterion on these runs, with the numbers beside it:",
            "\n".join(f"- **{criterion}**: {text}." for criterion, text in CRITERIA.items()),
        ),
        tables=(
            Table(
                "Verdicts", ("property", "controller", "paper", "ours", "decided by", "remark"), tuple(rows)
            ),
            _conflict_table(results),
        ),
        checks=(
            *(
                Check(f"HIMPC: {text}: {verdict.numbers}", float(verdict.holds or 0), bool(verdict.holds))
                for text, verdict in own.items()
            ),
            *_conflict_checks(results),
        ),
    )


def _agreement(paper: bool, ours: bool | None, criterion: str) -> str:
    if ours is None:
        return "no run"
    if paper == ours:
        return "agrees"
    if criterion == "Singularity-free" and ours:
        return "the paper did not run it, or judged from theory; on our arm it came through"
    return "the paper gives no criterion; by ours it comes out otherwise"


def _conflict_table(results: Results) -> Table:
    rows = []
    for controller in COMPARED:
        circle, conflict = results[rt1(controller)], results[rt2(controller)]
        ended = trouble(conflict)
        errors = (level_1(conflict), level_1(conflict) / level_1(circle), 1e3 * largest_error(conflict))
        rows.append(
            (
                name(controller),
                *("–" if ended else number(each) for each in errors),
                number(conflict.figure("limits", "torque", "max_ratio")),
                number(conflict.figure("limits", "velocity", "max_ratio")),
                number(conflict.figure("bound_active_share")),
                ended,
            )
        )
    columns = (
        "controller",
        "level-1 RMSE, RT2 (m)",
        "over RT1",
        "largest (mm)",
        "torque / bound",
        "speed / bound",
        "share of ticks at a bound",
        "",
    )
    return Table("Under conflict (RT2)", columns, tuple(rows))


def _conflict_checks(results: Results) -> Sequence[Check]:
    own, circle = results[rt2("himpc")], results[rt1("himpc")]
    hqp = results[rt2("hqp")]
    worse = level_1(hqp) / level_1(own)
    speed = hqp.figure("limits", "velocity", "max_ratio")
    checks = [
        at_most("HIMPC, RT2: level-1 RMSE (m)", level_1(own), 5e-4),
        at_most("HIMPC: level-1 RMSE in RT2 over RT1", level_1(own) / level_1(circle), 15.0),
        Check(
            "HQP, RT2: level-1 RMSE at least 4 × HIMPC's, or speed above 1.5 × its bound",
            worse,
            bool(worse >= 4.0 or speed > 1.5),
        ),
        at_most("HIMPC, RT3: level-1 RMSE over the whole run (m)", whole_run(results[rt3("himpc")]), 1e-3),
        at_most("HIMPC, RT3: unsolved QPs", results[rt3("himpc")].figure("solver", "unsolved"), 0),
    ]
    for controller in ("osf", "tdeosf"):
        run = results[rt2(controller)]
        error, demand = largest_error(run), run.figure("limits", "torque", "max_ratio")
        checks.append(
            Check(
                f"{name(controller)}, RT2: loses level 1 (error > 3 cm, or torque demand > 4 × its bound)",
                demand,
                bool(error > LOST_LEVEL_1 or demand > LOST_TORQUE),
            )
        )
    return checks


ITEMS = (Item("himpc-table-3", "Properties of four controllers", f"{SOURCE}-C, Table III", _jobs, _section),)

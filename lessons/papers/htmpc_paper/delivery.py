"""Fig. 9: the delivery rounds, hierarchical against single-task architecture, over all layouts of seats."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from lessons.experiments.jobs import Job, Results
from lessons.papers.htmpc_paper.runs import SOURCE
from lessons.papers.item import Check, Item, Row, Section, Table, at_most, between
from lessons.papers.printed import printed
from lessons.papers.words import number
from lessons.plots.panels import Curve, Panel, Picture
from lessons.scenes.run_spec import RunSpec

ARCHITECTURES = ("hierarchical", "single_task")


def _layouts(quick: bool) -> list[tuple[int, ...]]:
    layouts = list(combinations(range(6), 3))
    return layouts[:2] if quick else layouts


def _job(seats: tuple[int, ...], architecture: str) -> Job:
    listed = ",".join(map(str, seats))
    return Job(
        RunSpec(
            "ridgeback-ur10-delivery",
            controller="htmpc",
            set=(f"architecture={architecture}", f"seats=[{listed}]"),
        )
    )


def _jobs(quick: bool) -> tuple[Job, ...]:
    return tuple(_job(seats, a) for seats in _layouts(quick) for a in ARCHITECTURES)


def _report(results: Results, quick: bool) -> Section:
    times, ways, done, lines = [], [], [], []
    for seats in _layouts(quick):
        runs = [results[_job(seats, a)] for a in ARCHITECTURES]
        time = [run.figure("completion_time_s") for run in runs]
        way = [run.figure("base_path_m") for run in runs]
        times.append(time[1] / time[0])
        ways.append(way[1] / way[0])
        done += [run.figure("completed") == 1.0 for run in runs]
        lines.append((str(seats), *(number(x) for x in (*time, times[-1], *way, ways[-1]))))
    ratio, shorter = np.array(times), np.array(ways)
    paper = printed("htmpc_text")["delivery_time_ratio"]
    why = (
        "four rounds of our seats; where the paper's people stood and what its planner allowed is not printed"
    )
    columns = ("seats", "HT (s)", "ST (s)", "ST/HT", "HT way (m)", "ST way (m)", "ST/HT")
    checks = (
        Check("every layout completes", float(np.mean(done)), all(done)),
        between("ST/HT time, smallest", float(ratio.min()), 1.9, 3.5),
        between("ST/HT way of the base, smallest", float(shorter.min()), 1.0, 2.5),
        at_most("velocity over its limit", _largest(results, quick, "velocity"), 1.001),
        at_most("acceleration over its limit", _largest(results, quick, "acceleration"), 1.001),
    )
    curves = []
    for place, architecture in enumerate(ARCHITECTURES):
        run = results[_job(_layouts(quick)[0], architecture)]
        if len(run.t):
            base = run["x/base"]
            curves.append(Curve(base[:, 0], base[:, 1], architecture.replace("_", " "), str(place)))
    panel = Panel("y (m)", tuple(curves), "x (m)", equal=True)
    return Section(
        rows=(
            Row(
                "ST/HT execution time, mean over the layouts",
                "1",
                paper,
                float(ratio.mean()),
                why,
                turns_at=1.0,
                topic="deliveries",
            ),
        ),
        tables=(Table("Three of six seats, four rounds", columns, tuple(lines)),),
        checks=checks,
        pictures=(Picture("htmpc-fig-9", "Base paths of the first layout.", (panel,)),),
    )


def _largest(results: Results, quick: bool, kind: str) -> float:
    return float(np.max([results[job].figure("limits", kind, "max_ratio") for job in _jobs(quick)]))


ITEMS = (Item("htmpc-fig-9", "Delivery rounds", f"{SOURCE}-D, Fig. 9", _jobs, _report),)

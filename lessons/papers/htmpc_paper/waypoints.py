"""Fig. 8: base paths for two EE waypoints, by height and architecture."""

from __future__ import annotations

from lessons.experiments.jobs import Job, Results
from lessons.papers.htmpc_paper.runs import SOURCE
from lessons.papers.item import Item, Section, Table
from lessons.papers.words import number, trouble
from lessons.plots.panels import Panel, Picture, PlotCurve
from lessons.scenes.run_spec import RunSpec

HEIGHTS = (0.5, 0.8, 1.2)


def _cases() -> dict[str, Job]:
    scene = "ridgeback-ur10-waypoints"
    cases: dict[str, Job] = {
        f"HT, h = {height} m": Job(RunSpec(scene, controller="htmpc", set=(f"height={height}",)))
        for height in HEIGHTS
    }
    cases["ST, h = 0.8 m"] = Job(RunSpec(scene, controller="htmpc", set=("architecture=single_task",)))
    return cases


def _report(results: Results, quick: bool) -> Section:
    curves, lines = [], []
    for index, (words, job) in enumerate(_cases().items()):
        run = results[job]
        lines.append(
            (
                words,
                number(run.figure("base_path_m")),
                number(run.figure("completion_time_s")),
                trouble(run) or "completed" if run.figure("completed") == 1.0 else "not completed",
            )
        )
        if len(run.t):
            base = run["x/base"]
            curves.append(PlotCurve(base[:, 0], base[:, 1], words, str(index)))
    caption = "Base paths. The paper's waypoints are not printed: these are ours."
    panel = Panel("y (m)", tuple(curves), "x (m)", equal=True)
    columns = ("architecture", "way of the base (m)", "time (s)", "mission")
    return Section(
        tables=(Table("Two waypoints", columns, tuple(lines)),),
        pictures=(Picture("htmpc-fig-8", caption, (panel,)),),
    )


ITEMS = (
    Item(
        "htmpc-fig-8",
        "Base paths, two waypoints",
        f"{SOURCE}-D, Fig. 8",
        lambda quick: tuple(_cases().values()),
        _report,
    ),
)

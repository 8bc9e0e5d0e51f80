"""Measures the effect of our departures from the printed limits (32d) and (32e), on several plants."""

from __future__ import annotations

from collections.abc import Callable

from lessons.experiments.jobs import Job, JobResult, Results
from lessons.papers.himpc_paper.iiwa import RT4_DATA_SHEET
from lessons.papers.item import PaperCheck, Section, Table, at_most, between
from lessons.papers.texts import described, drawn
from lessons.papers.words import number, trouble, unprinted
from lessons.plots.panels import Bars
from lessons.scenes.run_spec import RunSpec

MODES = {
    "as printed": ("limits.position=paper", "limits.velocity_approach=0"),
    "barrier": ("limits.position=paper", "limits.velocity_approach=15"),
    "barrier and margin": (),
}
"""Three kinds of limits. The first kind has the rows as printed. In the second, the velocity bounds are
approached at a rate of 15 1/s. The third, the lab's default, also bounds each velocity by the position limit:
the joint can still stop 7 mrad before the limit, with a reaction time of a third of a second."""
PLANTS = {
    "nominal": (),
    "payload 1 kg": ("plant.payload_kg=1",),
    "payload 2 kg": ("plant.payload_kg=2",),
    "encoder 0.5e-3°": ("plant.encoder_resolution_deg=0.0005",),
    "friction 0.3 N·m": ("plant.friction=0.3",),
}


def _job(mode: str, plant: str) -> Job:
    return Job(RunSpec(RT4_DATA_SHEET, controller="himpc", set=(*MODES[mode], *PLANTS[plant])))


def _jobs(quick: bool) -> tuple[Job, ...]:
    plants = ("nominal", "payload 1 kg") if quick else tuple(PLANTS)
    return tuple(_job(mode, plant) for plant in plants for mode in MODES)


_KINDS = ("position", "velocity")


def _over(run: JobResult, kind: str) -> float:
    """Returns the largest ratio of a |value| to its limit."""
    return run.figure("limits", kind, "max_ratio")


def _level_1_mm(run: JobResult) -> float:
    return 1e3 * max(run.error_of("position", k) for k in range(3))


def _section(results: Results, quick: bool) -> Section:
    plants = [plant for plant in PLANTS if _job("as printed", plant) in results]
    cases = [(plant, mode, results[_job(mode, plant)]) for plant in plants for mode in MODES]
    rows = [
        unprinted(f"{plant}, {mode}: largest {kind} over its limit", "1", _over(run, kind), _WHY, band=0.25)
        for plant, mode, run in cases
        for kind in _KINDS
    ]
    lines = tuple(
        (
            plant,
            mode,
            *(number(_over(run, kind)) for kind in _KINDS),
            number(_level_1_mm(run)),
            number(run.figure("solver", "unsolved")),
            trouble(run),
        )
        for plant, mode, run in cases
    )
    columns = (
        "plant",
        "limits",
        "position / limit",
        "speed / limit",
        "level 1, worst axis (mm)",
        "QPs without a solution",
        "",
    )
    own = [run for _, mode, run in cases if mode == "barrier and margin"]
    checks: tuple[PaperCheck, ...] = tuple(
        check
        for plant, run in zip(plants, own, strict=True)
        for check in (
            at_most(f"{plant}, barrier and margin: position over its limit", _over(run, "position"), 1.0),
            at_most(
                f"{plant}, barrier and margin: QPs without a solution", run.figure("solver", "unsolved"), 0
            ),
        )
    )
    printed = results[_job("as printed", "nominal")]
    checks += (between("nominal, as printed: speed over its limit", _over(printed, "velocity"), 1.05, 2.0),)
    return drawn(
        "himpc-limits",
        _panels(results, plants),
        2,
        rows=tuple(rows),
        tables=(Table("Violations, errors and QPs without a solution", columns, lines),),
        checks=checks,
    )


_WHY = "the paper prints no number; its Fig. 13 shows slight violations of speed"


def _panels(results: Results, plants: list[str]) -> tuple[Bars, ...]:
    def bars(label: str, value: Callable[[JobResult], float]) -> Bars:
        series = tuple(
            (mode, str(index), tuple(value(results[_job(mode, plant)]) for plant in plants))
            for index, mode in enumerate(MODES)
        )
        return Bars(label, tuple(plant.replace(" ", "\n", 1) for plant in plants), series)

    return (
        bars("speed over its limit (%)", lambda run: 100.0 * (_over(run, "velocity") - 1.0)),
        bars("position over its limit (%)", lambda run: 100.0 * (_over(run, "position") - 1.0)),
        bars("QPs without a solution", lambda run: run.figure("solver", "unsolved")),
        bars("level 1, worst axis (mm)", _level_1_mm),
    )


ITEMS = (described("himpc-limits", _jobs, _section),)

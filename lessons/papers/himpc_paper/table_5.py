"""Tables IV and V: gains of the iiwa, RMSE with the inertia 20 % off."""

from __future__ import annotations

import numpy as np

from lessons.experiments.jobs import Job, Results
from lessons.papers.himpc_paper.iiwa import COORDINATES, DISTURBED, OPEN, RT4, RT4_DATA_SHEET, SOURCE, rt4
from lessons.papers.item import Check, Item, Row, Section, Table, at_most
from lessons.papers.printed import printed
from lessons.papers.words import gain_rows, number, trouble

_SCENES = {False: (RT4, RT4_DATA_SHEET), True: (RT4,)}
_READINGS = {
    "nominal": (),
    "links' rotational inertia scaled": (f"plant.inertia_scale={DISTURBED}",),
    "links' density scaled": (f"plant.mass_scale={DISTURBED}", f"plant.inertia_scale={DISTURBED}"),
    "diag M(q) scaled": (f"plant.diagonal_scale={DISTURBED}",),
}
_CHECKED = ("links' rotational inertia scaled", "diag M(q) scaled")
"""The two readings of the paper's words; links of another density are a third plant, for comparison."""


def _table_5_jobs(quick: bool) -> tuple[Job, ...]:
    return tuple(Job(scene, "himpc", extra) for scene in _SCENES[quick] for extra in _READINGS.values())


def _table_5(results: Results, quick: bool) -> Section:
    paper = printed("himpc_table_5")
    rows = []
    for reading, extra in _READINGS.items():
        run = results[rt4("himpc", *extra)]
        rows += [
            Row(
                f"{reading}: {label}",
                unit,
                paper["nominal" if reading == "nominal" else "disturbed"][task][k],
                run.error_of(task, k, "rmse"),
                trouble(run) or _why_table_5(task, reading),
            )
            for label, task, k, unit in COORDINATES
        ]
    return Section(
        notes=(
            f"RMSE over the whole run, which starts on the reference, N = 5. {OPEN} Some 300 readings were "
            "tried; none gives all seven numbers. Disturbed, the paper says 'each diagonal element of the "
            "inertia matrix': read as links with 20 % more or less rotational inertia, or density, and "
            "literally as diag M(q) altered in the dynamics, which no mechanism does.",
        ),
        rows=tuple(rows),
        tables=(*(_late(results, scene) for scene in _SCENES[quick]), _changes(results, quick)),
        checks=_table_5_checks(results, quick),
    )


def _why_table_5(task: str, reading: str) -> str:
    if task == "q1":
        return "the start or the limits of the paper's joint 1 differ from our reading"
    if reading == "diag M(q) scaled":
        return "our errors scale with diag M(q): estimation errors do, and the printed ones do not"
    return "errors scale with the unprinted inertias: half of them halves ours"


def _late(results: Results, scene: str) -> Table:
    rows = []
    for reading, extra in _READINGS.items():
        run = results[Job(scene, "himpc", extra)]
        errors = (run.error_of(task, k) for _, task, k, _ in COORDINATES)
        rows.append((reading, *map(number, errors), trouble(run)))
    columns = ("plant", *(f"{label} ({unit})" for label, _, _, unit in COORDINATES), "")
    what = "" if scene == RT4 else " (gravity on, data-sheet limits, from rest)"
    return Table(f"`{scene}`{what}: RMSE after the first second", columns, tuple(rows))


def _changes(results: Results, quick: bool) -> Table:
    rows = []
    for scene in _SCENES[quick]:
        for reading, extra in list(_READINGS.items())[1:]:
            change = _change(results, scene, extra)
            rows.append((scene, reading, *(f"{100 * (each - 1):+.1f} %" for each in change)))
    return Table(
        "Level-1 RMSE after the first second against nominal", ("scene", "plant", "x", "y", "z"), tuple(rows)
    )


def _change(results: Results, scene: str, extra: tuple[str, ...]) -> list[float]:
    nominal, disturbed = results[Job(scene)], results[Job(scene, "himpc", extra)]
    return [disturbed.error_of("position", k) / nominal.error_of("position", k) for k in range(3)]


def _table_5_checks(results: Results, quick: bool) -> tuple[Check, ...]:
    checks = []
    for scene in _SCENES[quick]:
        for reading in _CHECKED:
            extra = _READINGS[reading]
            worst = float(np.max(_change(results, scene, extra)))
            checks.append(at_most(f"`{scene}`, {reading}: worst level-1 RMSE over nominal", worst, 1.1))
    q1 = results[rt4()].error_of("q1", 0, "rmse")
    checks.append(
        Check("RMSE of q₁ within 5 % of 8.77° in the paper's scene", q1, abs(q1 / 8.773 - 1) <= 0.05)
    )
    return tuple(checks)


ITEMS = (
    Item(
        "himpc-table-4",
        "Gains of the iiwa's tasks",
        f"{SOURCE}-A, Table IV",
        lambda quick: (),
        lambda results, quick: Section(
            notes=("The gains that the scene uses, read from it.",),
            rows=gain_rows(RT4, printed("himpc_table_4")),
        ),
    ),
    Item("himpc-table-5", "RMSE, inertia 20 % off", f"{SOURCE}-B, Table V", _table_5_jobs, _table_5),
)

"""Runs items and writes the results: `report.md`, `results.json` and the pictures."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lessons.experiments.jobs import Results, perform_all
from lessons.outputs import write_files
from lessons.papers.disagreements import page
from lessons.papers.item import Item, PaperCheck, Row, Section, Table
from lessons.papers.stored import from_memory, judged, store, stored
from lessons.papers.words import number, tally
from lessons.plots.draw import draw
from lessons.plots.panels import Picture
from robots import InputError


@dataclass(frozen=True)
class Report:
    """An item with its section and the runs that failed or lost control.

    Attributes:
        judged: every row and check, compared with the stored numbers.
    """

    item: Item
    section: Section
    troubles: tuple[str, ...]
    judged: tuple[PaperCheck, ...] = ()

    @property
    def sound(self) -> bool:
        """Whether every check holds."""
        return not self.faults

    @property
    def faults(self) -> tuple[PaperCheck, ...]:
        """The checks that do not hold."""
        return tuple(check for check in (*self.section.checks, *self.judged) if not check.holds)


def reproduce(
    items: Sequence[Item], quick: bool = False, progress: Callable[[float], None] | None = None
) -> list[Report]:
    """Performs the runs of the items, shared runs only once, and makes the sections of the items.

    Args:
        items: what to reproduce.
        quick: shorter and fewer runs.
        progress: called with the completed share of the runs.
    """
    results = perform_all((job for item in items for job in item.jobs(quick)), progress)
    memory = stored(quick)
    reports = []
    for item in items:
        section = item.report(results, quick)
        checks = judged(section, memory.get(item.name))
        reports.append(Report(item, section, tuple(_troubles(item, quick, results)), checks))
    return reports


def recalled(items: Sequence[Item]) -> list[Report]:
    """Returns the reports without a run, from the stored numbers; items that were never stored are left
    out."""
    reports = []
    for quick in (True, False):
        for name, memory in stored(quick).items():
            item = next((item for item in items if item.name == name), None)
            if item is not None:
                section = from_memory(item, memory, quick)
                reports.append(Report(item, section, (), judged(section, memory)))
    # If both versions are stored, the whole version counts.
    latest = {report.item.name: report for report in reports}
    return [latest[item.name] for item in items if item.name in latest]


def _troubles(item: Item, quick: bool, results: Results) -> list[str]:
    troubles = []
    for job in dict.fromkeys(item.jobs(quick)):
        run = results[job]
        if run.error is not None:
            troubles.append(f"`{job.spec.command_line()}` could not be run: {run.error}")
        elif run.lost_at is not None:
            troubles.append(f"`{job.spec.command_line()}` lost control at {run.lost_at:.3f} s")
    return troubles


PAGE = "disagreements.md"


def write(reports: Sequence[Report], folder: Path, quick: bool) -> None:
    """Writes report.md, results.json and the pictures. Raises InputError if they cannot be written."""
    texts = {
        "results.json": json.dumps(as_data(reports, quick), indent=1) + "\n",
        "report.md": _markdown(reports, quick),
        PAGE: _page(reports),
    }
    _write(texts, [picture for report in reports for picture in report.section.pictures], folder)


def write_page(reports: Sequence[Report], folder: Path) -> None:
    """Writes only disagreements.md. Raises InputError if it cannot be written."""
    _write({PAGE: _page(reports)}, (), folder)


def _write(texts: Mapping[str, str], pictures: Sequence[Picture], folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for picture in pictures:
            draw(picture, folder)
        write_files({folder / name: text for name, text in texts.items()})
    except OSError as error:
        raise InputError(
            f"--out {folder}: cannot be written ({error.strerror}); give another folder"
        ) from None


def keep(reports: Sequence[Report], quick: bool) -> None:
    """Stores the measured numbers. Raises InputError if they cannot be written."""
    try:
        store({report.item.name: report.section for report in reports}, quick)
    except OSError as error:
        raise InputError(
            f"--store: cannot be written ({error.strerror}); install himpc-lab editable"
        ) from None


def _page(reports: Sequence[Report]) -> str:
    return page([(report.item.name, row) for report in reports for row in report.section.rows])


# -------------------------------------------------------------------------------- JSON


def as_data(reports: Sequence[Report], quick: bool) -> dict[str, Any]:
    """Returns the reports as JSON-ready data; numbers that are not finite become None."""
    return {"quick": quick, "items": [_item_data(report) for report in reports]}


def _item_data(report: Report) -> dict[str, Any]:
    section = report.section
    return {
        "name": report.item.name,
        "title": report.item.title,
        "source": report.item.source,
        "rows": [_row_data(row) for row in section.rows],
        "tables": [
            {"title": table.title, "columns": list(table.columns), "rows": [list(row) for row in table.rows]}
            for table in section.tables
        ],
        "checks": [
            {"text": check.text, "value": _finite(check.value), "holds": check.holds}
            for check in section.checks
        ],
        "not as stored": [check.text for check in report.judged if not check.holds],
        "notes": list(section.notes),
        "pictures": [f"{picture.name}.png" for picture in section.pictures],
        "troubles": list(report.troubles),
    }


def _row_data(row: Row) -> dict[str, Any]:
    return {
        "quantity": row.quantity,
        "unit": row.unit,
        "paper": row.paper,
        "ours": _finite(row.ours),
        "ratio": row.ratio,
        "verdict": row.verdict,
        "within": row.within,
        "remark": row.remark,
        "topic": row.topic,
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


# -------------------------------------------------------------------------------- Markdown


def _markdown(reports: Sequence[Report], quick: bool) -> str:
    checks = [check for report in reports for check in report.section.checks]
    held = sum(check.holds for check in checks)
    rows = [row for report in reports for row in report.section.rows]
    lines = [
        "# The papers' tables and figures, reproduced",
        "",
        "Written by `himpc-lab reproduce" + (" --quick" if quick else "") + "`. "
        f"{held} of {len(checks)} checks hold." + (" Quick: shorter and fewer runs." if quick else ""),
        "",
        f"Numbers and statements of the papers: {tally(rows)}. [Where we disagree](disagreements.md).",
        "",
        "Ratio: ours over the paper's. – : no such number. *agrees*: the ratio is within 10 % of 1, if no "
        "other tolerance is named, since neither paper prints its plant; *opposite*: an effect has the other "
        "direction. Every number is also compared with the stored one; deviations in both directions count.",
    ]
    for report in reports:
        lines += ["", f"## {report.item.name}: {report.item.title}", "", f"*{report.item.source}*"]
        section = report.section
        for note in section.notes:
            lines += ["", note]
        if section.rows:
            lines += ["", *_rows_markdown(section.rows)]
        for table in section.tables:
            lines += ["", *_table_markdown(table)]
        if section.checks:
            lines += ["", *(_check_markdown(check) for check in section.checks)]
        changed = [check for check in report.judged if not check.holds]
        if changed:
            lines += ["", "Not as stored:", "", *(_check_markdown(check) for check in changed)]
        for picture in section.pictures:
            lines += ["", f"![{picture.caption}]({picture.name}.png)", "", f"*{picture.caption}*"]
        if report.troubles:
            lines += ["", *(f"- {trouble}" for trouble in report.troubles)]
    return "\n".join(lines) + "\n"


def _rows_markdown(rows: Sequence[Row]) -> list[str]:
    table = [
        (
            row.quantity,
            row.unit,
            row.says or number(row.paper),
            number(row.ours),
            number(row.ratio),
            row.verdict,
            row.remark,
        )
        for row in rows
    ]
    return _grid(("", "unit", "paper", "ours", "ratio", "verdict", "remark"), table)


def _table_markdown(table: Table) -> list[str]:
    return [f"**{table.title}**", "", *_grid(table.columns, table.rows)]


def _grid(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    cells = [[cell.replace("|", "\\|") for cell in row] for row in (columns, ["---"] * len(columns), *rows)]
    return [f"| {' | '.join(row)} |" for row in cells]


def _check_markdown(check: PaperCheck) -> str:
    return f"- {'✓' if check.holds else '✗'} {check.text} (measured: {number(check.value)})"

"""`himpc-lab reproduce`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from app.commands.output import print_table, progress_bar, write_json
from robots import InputError
from robots.errors import unknown_name

if TYPE_CHECKING:
    from lessons.papers.reproduce import Report


def reproduce(
    items: tyro.conf.Positional[tuple[str, ...]] = (),
    out: Path = Path("reproduction"),
    quick: bool = False,
    stored: bool = False,
    store: bool = False,
    json: str | None = None,
) -> int:
    """Reproduce tables and figures of the papers, and compare every printed value with ours.

    Writes report.md, disagreements.md, results.json and PNG plots. Every number of a paper gets a verdict:
    agrees, differs or opposite. Exit code 1 if a check does not hold, or a number differs from its stored
    value.

    Args:
        items: names of tables and figures, e.g. himpc-table-2 himpc-fig-12; all of them by default.
        out: folder to write to.
        quick: do fewer and shorter runs.
        stored: run nothing; only judge the stored numbers and write disagreements.md.
        store: store the measured numbers; later runs are compared with them.
        json: write the results also as JSON to this file, or to standard output for "-".
    """
    from lessons.papers import ITEMS
    from lessons.papers.reproduce import as_data, keep, recalled, write, write_page
    from lessons.papers.reproduce import reproduce as reproduce_items

    for name in items:
        if name not in ITEMS:
            raise unknown_name("item", name, ITEMS)
    if stored and (quick or store):
        raise InputError("--stored runs nothing: leave out --quick and --store")
    chosen = [ITEMS[name] for name in dict.fromkeys(items or ITEMS)]
    if stored:
        reports = recalled(chosen)
        write_page(reports, out)
    else:
        with progress_bar(f"{len(chosen)} items …", shown=json is None) as advance:
            reports = reproduce_items(chosen, quick, advance)
        write(reports, out, quick)
    if store:
        keep(reports, quick)
    # Results that were just stored are not compared with those stored before.
    sound = (
        all(check.holds for report in reports for check in report.section.checks)
        if store
        else all(report.sound for report in reports)
    )
    if json is not None:
        write_json(as_data(reports, quick), json)
    else:
        _print(reports)
        print(f"report: {out / ('disagreements.md' if stored else 'report.md')}")
    return 0 if sound else 1


def _print(reports: Sequence[Report]) -> None:
    """Prints every number with its verdict, the passed checks per item, and the failures."""
    from lessons.papers.words import number, tally

    for report in reports:
        lines = [
            [row.verdict or "–", row.says or number(row.paper), number(row.ours), row.unit, row.quantity]
            for row in report.section.rows
        ]
        if lines:
            title = f"{report.item.name}: {report.item.title}"
            print_table(title, ("verdict", "paper", "ours", "unit", "of what"), lines)
    rows = []
    for report in reports:
        checks = report.section.checks
        held = f"{sum(check.holds for check in checks)} of {len(checks)}" if checks else "–"
        rows.append([report.item.name, report.item.title, tally(report.section.rows), held])
    print_table("Reproduced", ("item", "what it is", "verdicts", "checks that hold"), rows)
    for report in reports:
        for check in report.faults:
            print(f"{report.item.name}: does not hold: {check.text} (measured {number(check.value)})")

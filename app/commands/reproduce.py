"""`himpc-lab reproduce`."""

from __future__ import annotations

from pathlib import Path

import tyro

from app.commands.output import print_table, write_json
from app.commands.progress import progress_bar
from robots.errors import unknown_name


def reproduce(
    items: tyro.conf.Positional[tuple[str, ...]] = (),
    out: Path = Path("reproduction"),
    quick: bool = False,
    json: str | None = None,
) -> int:
    """Reproduce tables and figures of the papers: every printed value beside ours.

    Writes report.md, results.json and PNG plots. Exit code 1 if one of the stated checks does not hold.

    Args:
        items: which, e.g. himpc-table-2 himpc-fig-12; all of them by default.
        out: folder to write to.
        quick: shorter and fewer runs.
        json: write the results also as JSON to this file, or to standard output for "-".
    """
    from lessons.papers import ITEMS
    from lessons.papers.reproduce import as_data, write
    from lessons.papers.reproduce import reproduce as reproduce_items
    from lessons.papers.words import number

    for name in items:
        if name not in ITEMS:
            raise unknown_name("item", name, ITEMS)
    chosen = [ITEMS[name] for name in dict.fromkeys(items or ITEMS)]
    with progress_bar(f"{len(chosen)} items …", shown=json is None) as advance:
        reports = reproduce_items(chosen, quick, advance)
    write(reports, out, quick)
    sound = all(report.sound for report in reports)
    if json is not None:
        write_json(as_data(reports, quick), json)
        return 0 if sound else 1
    rows = []
    for report in reports:
        checks = report.section.checks
        held = f"{sum(check.holds for check in checks)} of {len(checks)}" if checks else "–"
        rows.append([report.item.name, report.item.title, str(len(report.section.rows)), held])
    print_table("Reproduced", ("item", "what it is", "numbers", "checks that hold"), rows)
    for report in reports:
        for check in report.section.checks:
            if not check.holds:
                print(f"{report.item.name}: does not hold: {check.text} (measured {number(check.value)})")
    print(f"report: {out / 'report.md'}")
    return 0 if sound else 1

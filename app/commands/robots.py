"""`himpc-lab robots`."""

from __future__ import annotations

from typing import Annotated

import tyro

from app.commands.output import print_table, write_json


def robots(
    check: str | None = None,
    hold: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="PATTERN")] = (),
    json: str | None = None,
) -> int:
    """List the robots of the catalog, or check a URDF file. The check reports every repair, default value and
    refusal.

    Args:
        check: the URDF file to check. Exit code 1 if it cannot be used.
        hold: hold the joints with this name or regular expression, as for himpc-lab run.
        json: write JSON to this file, or to standard output for "-".
    """
    if check is None:
        from robots import CATALOG

        entries = [
            {"name": entry.name, "title": entry.title, "tip": entry.tip, "joints": len(entry.M_bar)}
            for entry in CATALOG.values()
        ]
        if json is not None:
            write_json(entries, json)
        else:
            rows = [[str(value) for value in entry.values()] for entry in entries]
            print_table("Robots", ("robot", "what it is", "tip", "joints"), rows)
        return 0
    from robots import check_urdf

    report = check_urdf(check, hold)
    if json is not None:
        write_json({**report.as_dict(), "usable": report.usable}, json)
    else:
        verdict = "can be used" if report.usable else "cannot be used"
        rows = [[finding.kind, finding.where, finding.text] for finding in report.findings]
        title = f"{check} {verdict}: {len(report.joints)} joints, tip '{report.tip}'"
        print_table(title, ("finding", "where", "what"), rows)
    return 0 if report.usable else 1

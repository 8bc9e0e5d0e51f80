"""`himpc-lab robots`."""

from __future__ import annotations

from typing import Annotated

import tyro

from app.commands.output import print_table, write_json

RobotFile = Annotated[str | None, tyro.conf.arg(aliases=("--robot",), metavar="FILE")]
"""The option that names a robot."""


def robots(check: str | None = None, json: str | None = None) -> int:
    """List the robots of the catalog, or check a robot's file. The check reports every repair, default value
    and refusal.

    Args:
        check: the URDF or MuJoCo model to check, or a folder or zip with one. Exit code 1 if it cannot be
            used.
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

    report = check_urdf(check)
    if json is not None:
        write_json({**report.as_dict(), "usable": report.usable}, json)
    else:
        verdict = "can be used" if report.usable else "cannot be used"
        rows = [[finding.kind, finding.where, finding.text] for finding in report.findings]
        title = f"{check} {verdict}: {len(report.joints)} joints, tip '{report.tip}'"
        print_table(title, ("finding", "where", "what"), rows)
    return 0 if report.usable else 1

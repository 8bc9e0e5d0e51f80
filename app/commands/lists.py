"""`himpc-lab scenes`, `controllers` and `robots`: lists, and the check of a robot."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import tyro

from app.commands.output import print_list, print_table, write_json

RobotFile = Annotated[str | None, tyro.conf.arg(aliases=("--robot",), metavar="FILE")]
"""The option that names a robot."""
HeldJoints = Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="PATTERN")]
"""The option that holds joints."""
Tool = Annotated[str | None, tyro.conf.arg(metavar="X,Y,Z[,ROLL,PITCH,YAW]")]
"""The option that adds a tool."""


def scenes(json: str | None = None) -> int:
    """List the scenes.

    Args:
        json: write JSON to this file, or to standard output for "-".
    """
    from lessons.scenes.names import ALL_SCENES

    return print_list("Scenes", "scene", ALL_SCENES, json)


def controllers(json: str | None = None) -> int:
    """List the controllers.

    Args:
        json: write JSON to this file, or to standard output for "-".
    """
    from himpc.catalog import CONTROLLERS, VELOCITY_CONTROLLERS

    return print_list("Controllers", "controller", CONTROLLERS | VELOCITY_CONTROLLERS, json)


def robots(check: str | None = None, hold: HeldJoints = (), json: str | None = None) -> int:
    """List the robots of the catalog, or check a robot's file. The check prints every repair, default value
    and refusal, and how the robot moves: its target is dragged by 15 % of the arm's length and back.

    Args:
        check: the URDF or MuJoCo model to check, or a folder or zip with one. Exit code 1 if it cannot be
            used.
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
    from lessons.experiments.drag import dragged
    from lessons.settings.values import finite
    from robots.loading.load import import_file

    found = import_file(Path(check), hold=hold)
    report, motion = found.report, None if found.robot is None else dragged(found.robot)
    if json is not None:
        told = None if motion is None else {**asdict(motion), "follows": motion.follows, "text": str(motion)}
        write_json(finite({**report.as_dict(), "motion": told}), json)
    else:
        verdict = "can be used" if report.usable else "cannot be used"
        print(f"{check} {verdict}: {len(report.joints)} joints, tip '{report.tip}'")
        for line in (*report.findings, *(() if motion is None else (f"motion: {motion}",))):
            print(line)
    return 0 if report.usable else 1

"""The verdict on a robot by its motion, computed in a process of its own. This module loads no controller."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from threading import Lock

from robots.processes.isolation import Allowance, Fault, isolated
from robots.robot import Robot

_DRAGGING = Allowance(
    60.0, 4_000_000_000, "dragging it", "ended the process that drags it", "try himpc-lab robots --check"
)
_KEPT = 16  # number of robots whose verdicts are kept
_one = Lock()  # one robot is dragged at a time
_known: dict[tuple[str, str], str] = {}


def verdict(robot: Robot) -> str:
    """Returns how a robot follows a dragged target, or why this is not known (see
    `lessons.experiments.drag.Motion`). It takes some seconds, and at most 60 s of processor time; a robot
    that was dragged is answered at once."""
    key = (robot.urdf_text, robot.tip)
    with _one:
        if key not in _known:
            try:
                _known[key] = isolated(_dragged, replace(robot, surfaces=()), within=_DRAGGING)
            except Fault as fault:
                _known[key] = f"not known: {fault}"
            if len(_known) > _KEPT:
                del _known[next(iter(_known))]
        return _known[key]


def _dragged(robot: Robot) -> str:
    from lessons.experiments.drag import dragged

    with suppress(OSError, AttributeError):
        os.nice(10)  # the page and its simulation come first
    return str(dragged(robot))

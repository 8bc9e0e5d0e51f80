"""The missions of the scenes with obstacles. In one mission the robot passes obstacles on both sides of its
way, in the other an obstacle that is reported at a wrong place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from himpc.missions import Follow, Go, Mission, MissionTask
from himpc.references import Path
from lessons.settings.missions import CRUISE, Home, MissionOptions, OrderOptions
from robots import InputError
from robots.collision import Ball, Box, Floor, Obstacle
from robots.ranges import Range, Shown, check_fields

CLUTTER: tuple[Obstacle, ...] = (
    Floor(),
    Box("table", (2.0, 0.95, 0.4), (1.2, 0.5, 0.8)),
    Ball("bin", (1.6, -1.0, 0.3), 0.3),
    Ball("lamp", (3.4, 0.55, 1.3), 0.2),
)
"""Obstacles on both sides of the base's path."""


@dataclass(frozen=True)
class ClutteredOptions(MissionOptions):
    """The base is sent past obstacles; the EE goes first to a place beside the way."""

    goal: Annotated[tuple[float, ...], Range(-1e3, 1e3), Shown("Goal", "Goal of the base, x and y", "m")] = (
        4.0,
        0.0,
    )

    def mission(self, home: Home) -> Mission:
        return (
            MissionTask("ee", "ee", Go((4.9, 0.2, 0.9)), hold=3.0),
            MissionTask("base", "base", Go(self.goal), 0.02),
        )


WAY = 4.0
"""Length of the way of hand and base along x, m."""
CRATE = "crate"
"""Name of the obstacle that is reported wrongly."""
BESIDE_THE_WAY: tuple[Obstacle, ...] = (Floor(), Box(CRATE, (1.9, 1.4, 0.25), (0.4, 0.4, 0.5)))
"""A crate, low enough for the hand to pass above it, 1.2 m beside the way of the base."""


@dataclass(frozen=True)
class PerceptionOptions(OrderOptions):
    """Hand and base move along straight parallel paths, and for a while the crate is reported elsewhere.

    The controller avoids the crate at its reported place; whether something is touched depends on its true
    place.

    Attributes:
        report_offset: the reported position minus the true one while the report is wrong, m.
        report_start, report_end: times from which the report is wrong, and from which it is right again, s.
    """

    # fmt: off
    cruise: Annotated[float, Range(0.0, 100.0, above=True), Shown(
        "Cruise", "Speed along the planned paths of the base", "m/s", 0.1, 1.0, 0.05)] = CRUISE
    false_report: Annotated[bool, Shown(
        "Reported wrongly", "Whether a wrong position of the crate is reported to the controller for a while",
        tries=("false", "true"), name="false report")] = True
    report_offset: Annotated[tuple[float, ...], Range(-10.0, 10.0), Shown(
        "Reported minus true position", "Position of the crate as it is reported, minus its true position, "
        "while the report is wrong", "m", -3.0, 3.0, 0.05)] = (0.0, -1.1, 0.0)
    report_start: Annotated[float, Range(0.0, 1e5), Shown(
        "Wrong from", "Time from which the report is wrong", "s", 0.0, 12.0, 0.5)] = 1.0
    report_end: Annotated[float, Range(0.0, 1e5), Shown(
        "Right again from", "Time from which the report is right again", "s", 0.0, 12.0, 0.5,
        tries=("5", "6", "7", "8", "9"), name="report right again from, s")] = 7.0
    # fmt: on

    def __post_init__(self) -> None:
        """Raises InputError for invalid options."""
        if len(self.report_offset) != 3:
            count = len(self.report_offset)
            raise InputError(f"report_offset has {count} numbers: give x, y and z, e.g. [0, -1.1, 0]")
        check_fields(self)

    @property
    def misreported(self) -> tuple[float, float] | None:
        wrong = self.false_report and self.report_start < self.report_end
        return (self.report_start, self.report_end) if wrong else None

    def reported(self, obstacles: tuple[Obstacle, ...], t: float) -> tuple[Obstacle, ...]:
        # Times are multiples of the control period, except for rounding errors.
        if self.misreported is None or not self.report_start <= t + 1e-9 < self.report_end:
            return obstacles
        return tuple(self._moved(obstacle) for obstacle in obstacles)

    def _moved(self, obstacle: Obstacle) -> Obstacle:
        if isinstance(obstacle, Floor) or obstacle.name != CRATE:
            return obstacle
        x, y, z = (at + off for at, off in zip(obstacle.centre, self.report_offset, strict=True))
        return replace(obstacle, centre=(x, y, z))

    def mission(self, home: Home) -> Mission:
        return self.in_order(
            tuple(MissionTask(role, role, _along(home[role], self.cruise)) for role in ("ee", "base"))
        )


def _along(point: np.ndarray, cruise: float) -> Follow:
    """Returns a straight path along x from a point (m,), m."""
    ahead = np.zeros(len(point))
    ahead[0] = WAY
    return Follow(Path(np.array([point, point + ahead]), cruise, "quintic", 0.0))

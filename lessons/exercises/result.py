"""The grade of a submission, as data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class CheckResult:
    """One check with the measured value.

    Attributes:
        check: the sentence of the check.
        measured: value in `unit`; NaN if there was nothing to measure.
        unit, wanted: e.g. "mm", "≤ 0.5 mm".
        points, of: the points for this check, and the largest possible number of points.
        why: one sentence with the cause if the check fails, "" if it holds.
    """

    check: str
    measured: float
    unit: str
    wanted: str
    points: int
    of: int
    why: str


@dataclass(frozen=True)
class Grade:
    """The grade of a submission.

    Attributes:
        file: path of the submission.
        digest: hash of the content of the file.
        exercise: name of the exercise, "" if it is unknown.
        lines: one per check; empty if the file could not be run.
        error: one sentence if the file could not be run, or its process was ended.
        protection: mechanisms of the operating system that blocked access to files, the network and other
            processes; () if only Python blocked it.
        possible: largest number of points, for a file that could not be run.
    """

    file: str
    digest: str
    exercise: str
    lines: tuple[CheckResult, ...] = ()
    error: str = ""
    protection: tuple[str, ...] = ()
    possible: int = 10

    @property
    def points(self) -> int:
        return sum(line.points for line in self.lines)

    @property
    def of(self) -> int:
        return sum(line.of for line in self.lines) or self.possible

    @property
    def passed(self) -> bool:
        return not self.error and self.points == self.of


def as_data(grade: Grade) -> dict[str, Any]:
    """JSON-ready."""
    return {
        "file": grade.file,
        "sha256": grade.digest,
        "exercise": grade.exercise,
        "points": grade.points,
        "of": grade.of,
        "error": grade.error,
        "protection": list(grade.protection),
        "checks": [
            {**vars(line), "measured": line.measured if math.isfinite(line.measured) else None}
            for line in grade.lines
        ],
    }

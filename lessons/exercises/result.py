"""The grade of a submission as data, and in the formats that other systems read: Gradescope, and GitHub's
classroom actions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal


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


Format = Literal["gradescope", "github"]
Visibility = Literal["visible", "hidden", "after_due_date", "after_published"]


def formatted(grade: Grade, form: Format, visibility: Visibility = "visible") -> dict[str, Any]:
    """Returns a grade in a format. visibility: when Gradescope shows the checks to students."""
    return gradescope(grade, visibility) if form == "gradescope" else github(grade)


def gradescope(grade: Grade, visibility: Visibility = "visible") -> dict[str, Any]:
    """Returns the content of Gradescope's results.json as data for JSON."""
    return {
        "score": grade.points,
        "output": _output(grade),
        "output_format": "text",
        "visibility": visibility,
        "stdout_visibility": "hidden",
        "tests": [
            {
                "name": line.check,
                "score": line.points,
                "max_score": line.of,
                "status": "passed" if line.points == line.of else "failed",
                "output": _message(line),
                "output_format": "text",
                "visibility": visibility,
            }
            for line in grade.lines
        ],
        "extra_data": {"exercise": grade.exercise, "sha256": grade.digest, "points possible": grade.of},
    }


def github(grade: Grade) -> dict[str, Any]:
    """Returns the result for the autograding reporter of GitHub Classroom as data for JSON. The reporter
    reads it in base64."""
    status = "error" if grade.error else "pass" if grade.passed else "fail"
    tests = [
        {
            "name": line.check,
            "status": "pass" if line.points == line.of else "fail",
            "score": line.points,
            "message": _message(line),
            "test_code": line.wanted,
            "filename": "",
            "line_no": 0,
        }
        for line in grade.lines
    ]
    # The reporter divides by the number of tests. An empty list is replaced by one failed test.
    failed = {"name": grade.exercise or "grade", "status": "error", "score": 0, "message": grade.error}
    return {"version": 1, "status": status, "max_score": grade.of, "tests": tests or [failed]}


def _message(line: CheckResult) -> str:
    measured = "–" if math.isnan(line.measured) else f"{line.measured:.3g} {line.unit}"
    return f"measured {measured}, required {line.wanted}" + (f"; {line.why}" if line.why else "")


def _output(grade: Grade) -> str:
    if grade.error:
        return f"{grade.error}\n0 of {grade.of} points"
    return f"{grade.exercise}: {grade.points} of {grade.of} points"

"""A grade in the formats that other systems read: Gradescope, and GitHub's classroom actions."""

from __future__ import annotations

import math
from typing import Any, Literal, get_args

from lessons.exercises.result import CheckResult, Grade

Format = Literal["gradescope", "github"]
FORMATS: tuple[Format, ...] = get_args(Format)
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

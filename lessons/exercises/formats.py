"""A grade in the formats that other systems read: Gradescope, and GitHub's classroom actions."""

from __future__ import annotations

import math
from typing import Any, Literal, get_args

from lessons.exercises.result import CheckResult, Grade

Format = Literal["gradescope", "github"]
FORMATS: tuple[Format, ...] = get_args(Format)
Visibility = Literal["visible", "hidden", "after_due_date", "after_published"]


def formatted(found: Grade, form: Format, visibility: Visibility = "visible") -> dict[str, Any]:
    """Returns a grade in a format. visibility: when Gradescope shows the checks to students."""
    return gradescope(found, visibility) if form == "gradescope" else github(found)


def gradescope(found: Grade, visibility: Visibility = "visible") -> dict[str, Any]:
    """Returns the content of Gradescope's results.json as data for JSON."""
    return {
        "score": found.points,
        "output": _output(found),
        "output_format": "text",
        "visibility": visibility,
        "stdout_visibility": "hidden",
        "tests": [
            {
                "name": line.check,
                "score": line.points,
                "max_score": line.of,
                "status": "passed" if line.points == line.of else "failed",
                "output": _said(line),
                "output_format": "text",
                "visibility": visibility,
            }
            for line in found.lines
        ],
        "extra_data": {"exercise": found.exercise, "sha256": found.digest, "points possible": found.of},
    }


def github(found: Grade) -> dict[str, Any]:
    """Returns the result for the autograding reporter of GitHub Classroom as data for JSON. The reporter
    reads it in base64."""
    status = "error" if found.error else "pass" if found.passed else "fail"
    tests = [
        {
            "name": line.check,
            "status": "pass" if line.points == line.of else "fail",
            "score": line.points,
            "message": _said(line),
            "test_code": line.wanted,
            "filename": "",
            "line_no": 0,
        }
        for line in found.lines
    ]
    # The reporter divides by the number of tests. An empty list is replaced by one failed test.
    failed = {"name": found.exercise or "grade", "status": "error", "score": 0, "message": found.error}
    return {"version": 1, "status": status, "max_score": found.of, "tests": tests or [failed]}


def _said(line: CheckResult) -> str:
    measured = "–" if math.isnan(line.measured) else f"{line.measured:.3g} {line.unit}"
    return f"measured {measured}, required {line.wanted}" + (f"; {line.why}" if line.why else "")


def _output(found: Grade) -> str:
    if found.error:
        return f"{found.error}\n0 of {found.of} points"
    return f"{found.exercise}: {found.points} of {found.of} points"

"""`himpc-lab lessons`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.commands.output import figure, print_table, progress_bar, write_json

if TYPE_CHECKING:
    from lessons.teaching.check import Verdict
    from lessons.teaching.lesson import Lesson


def lessons(
    check: Annotated[tuple[str, ...] | None, tyro.conf.arg(metavar="[NAME …]")] = None,
    json: str | None = None,
) -> int:
    """List the lessons, or run them headless and judge every claim.

    The check runs the script of each lesson. Every claim must hold, and must fail with the wrong setting that
    it names. Every challenge must fail with its first settings and be passed with its solutions. The number
    of every note beside a sentence must lie in its range. If there are faults, one sentence per fault is
    printed, and the exit code is 1.

    Args:
        check: names of the lessons to check, or Markdown files of your own; --check without names: all
            lessons.
        json: write JSON to this file, or to standard output for "-".
    """
    from lessons.authoring.lesson import lesson_named
    from lessons.course import COURSE
    from lessons.teaching.check import check as check_lessons

    chosen = [lesson_named(name) for name in dict.fromkeys(check or COURSE)]
    if check is None:
        return _list(chosen, json)
    with progress_bar(f"{len(chosen)} lessons …", shown=json is None) as advance:
        verdicts = check_lessons(chosen, progress=advance)
    sound = not any(verdict.fault for verdict in verdicts)
    if json is not None:
        write_json(_as_data(chosen, verdicts), json)
        return 0 if sound else 1
    for lesson in chosen:
        rows = [_row(verdict) for verdict in verdicts if verdict.lesson == lesson.name]
        columns = ("", "step and its statement", "measured", "must be", "where it must fail")
        print_table(f"{lesson.card.title} ({lesson.name})", columns, rows)
    for verdict in verdicts:
        if verdict.fault:
            print(f"{verdict.lesson}, {verdict.where}: “{verdict.what}”: {verdict.fault}")
    faults = sum(bool(verdict.fault) for verdict in verdicts)
    print(f"lessons: {len(chosen)}, checks: {len(verdicts)}, faults: {faults}")
    return 0 if sound else 1


def _list(chosen: Sequence[Lesson], json: str | None) -> int:
    if json is not None:
        cards = [
            {
                "name": lesson.name,
                "title": lesson.card.title,
                "question": lesson.card.question,
                "minutes": lesson.card.minutes,
                "needs": lesson.card.needs,
                "scene": lesson.scene,
                "steps": [step.title for step in lesson.steps],
                "challenge": lesson.challenge is not None,
            }
            for lesson in chosen
        ]
        write_json(cards, json)
        return 0
    rows = [
        [lesson.name, lesson.card.title, lesson.card.question, str(lesson.card.minutes)] for lesson in chosen
    ]
    print_table("Lessons", ("lesson", "title", "question", "minutes"), rows)
    return 0


def _row(verdict: Verdict) -> list[str]:
    wrong = f"{figure(verdict.wrong_value)} with {verdict.wrong}" if verdict.wrong else ""
    measured = f"{figure(verdict.value)} {verdict.unit}".rstrip()
    sign = "FAULT" if verdict.fault else "ok"
    return [sign, f"{verdict.where}: {verdict.what}", measured, verdict.condition, wrong]


def _as_data(chosen: Sequence[Lesson], verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """Returns data for JSON: the verdicts per lesson. Numbers that are not finite become null."""
    return {
        "sound": not any(verdict.fault for verdict in verdicts),
        "lessons": [
            {
                "name": lesson.name,
                "sound": not any(v.fault for v in verdicts if v.lesson == lesson.name),
                "checks": [_check_data(v) for v in verdicts if v.lesson == lesson.name],
            }
            for lesson in chosen
        ],
    }


def _check_data(verdict: Verdict) -> dict[str, Any]:
    return {
        "step": verdict.where,
        "what": verdict.what,
        "measured": verdict.value if math.isfinite(verdict.value) else None,
        "unit": verdict.unit,
        "must_be": verdict.condition,
        "wrong_setting": verdict.wrong or None,
        "measured_there": verdict.wrong_value if math.isfinite(verdict.wrong_value) else None,
        "sound": not verdict.fault,
        "fault": verdict.fault or None,
    }

"""The command `himpc-lab lessons`."""

from __future__ import annotations

import json

import pytest

from app.__main__ import main
from lessons.course import COURSE
from lessons.teaching.check import Verdict


def test_lessons_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lessons"]) == 0
    assert "a-redundant-arm" in capsys.readouterr().out
    assert main(["lessons", "--json", "-"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert tuple(lesson["name"] for lesson in listed) == COURSE
    assert all(lesson["question"].endswith("?") and lesson["steps"] for lesson in listed)


def test_an_unknown_lesson_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lessons", "--check", "one-tsak"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "one-task" in shown.err
    assert shown.err.count("\n") == 1


def verdicts(fault: str) -> list[Verdict]:
    sound = Verdict("one-task", "s", "It holds.", 1.0, "mm", "≤ 2 mm", "N=1", 3.0)
    return [
        sound,
        Verdict("one-task", "s", "Here.", float("nan"), "mm", "≤ 2 mm", "N=1", float("inf"), fault),
    ]


def test_a_fault_is_exit_code_1(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Each fault gives one sentence and exit code 1; without faults the exit code is 0."""
    monkeypatch.setattr(
        "lessons.teaching.check.check", lambda *args, **options: verdicts("it is false: 3 mm")
    )
    assert main(["lessons", "--check", "one-task"]) == 1
    assert "one-task, s: “Here.”: it is false: 3 mm" in capsys.readouterr().out.replace("\n", "")
    monkeypatch.setattr("lessons.teaching.check.check", lambda *args, **options: verdicts(""))
    assert main(["lessons", "--check", "one-task"]) == 0


def test_the_verdicts_as_json(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Standard output is one valid JSON object, also for checks without a measured value."""
    monkeypatch.setattr("lessons.teaching.check.check", lambda *args, **options: verdicts("it is false"))
    assert main(["lessons", "--check", "one-task", "--json", "-"]) == 1
    result = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert result["sound"] is False
    (lesson,) = result["lessons"]
    assert [check["sound"] for check in lesson["checks"]] == [True, False]
    assert [check["measured"] for check in lesson["checks"]] == [1.0, None]
    assert lesson["checks"][1]["fault"] == "it is false"

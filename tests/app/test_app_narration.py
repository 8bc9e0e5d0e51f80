"""The line that says what happens. On a page it is tested in test_app_controls.py."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from app.tab.comfort import AT_MOST_EVERY, Facts, Narration

STILL = Facts(True, 0, (("position", True), ("posture", True)), {"position": (0.0, "m")}, frozenset())


class RunDescription:
    """A narration with a clock of its own."""

    def __init__(self) -> None:
        self.t = 0.0
        self.narration = Narration(lambda: self.t)
        assert self.narration.look(STILL) == ""

    def look(self, facts: Facts, after: float = AT_MOST_EVERY) -> str:
        self.t += after
        return self.narration.look(facts)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"running": False}, "Paused."),
        ({"resets": 1}, "Robot back at its start."),
        ({"levels": (("position", True), ("posture", False))}, "Level 2, posture, switched off."),
        ({"levels": (("posture", True), ("position", True))}, "The levels are now posture, position."),
        ({"limits": frozenset({("torque", "joint 2")})}, "Torque limit of joint 2 is met."),
        ({"limits": frozenset({("lexicographic", "ee x")})}, ""),
    ],
)
def test_what_changes_is_said_once(change: dict[str, Any], words: str) -> None:
    one = RunDescription()
    now = replace(STILL, **change)
    assert one.look(now) == words
    assert one.look(now) == ""


def test_an_error_is_said_when_it_has_come_to_rest() -> None:
    one = RunDescription()
    said = [one.look(replace(STILL, errors={"position": (each, "m")})) for each in (0.3, 0.1, 0.02, 0.003)]
    assert said == [""] * 4
    assert one.look(replace(STILL, errors={"position": (0.003, "m")})) == "Position 3.00 mm from its target."
    assert one.look(replace(STILL, errors={"position": (0.0031, "m")})) == ""


def test_there_is_at_most_one_sentence_in_two_seconds_and_it_has_all_that_happened() -> None:
    one = RunDescription()
    assert one.look(replace(STILL, running=False)) == "Paused."
    off = replace(STILL, levels=(("position", False), ("posture", True)))
    assert one.look(off, after=0.2) == ""
    assert one.look(replace(off, resets=1), after=0.2) == ""
    assert one.look(replace(off, resets=1), after=1.7) == (
        "Running; level 1, position, switched off; robot back at its start."
    )


def test_a_limit_that_comes_and_goes_is_not_said_again_and_again() -> None:
    one, met = RunDescription(), replace(STILL, limits=frozenset({("velocity", "joint 1")}))
    said = [one.look(met if k % 2 else STILL, after=0.5) for k in range(40)]
    assert [each for each in said if each] == ["Velocity limit of joint 1 is met."]

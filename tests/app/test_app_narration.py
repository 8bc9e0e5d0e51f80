"""The line that says what happens, the fields that move targets without a mouse, and the pause in which a
page begins for users who asked for less motion."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from served import served
from viser import _messages

from app.page.comfort import AT_MOST_EVERY, MOTION, REDUCED, Facts, Narration
from browsing.wire import Wire, eventually

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


class Reader(Wire):
    """A browser whose user asked for less motion."""

    def __enter__(self) -> Reader:
        return self

    def _take(self, message: dict[str, Any]) -> None:
        if message["type"] == "LocalStorageGetItemRequestMessage" and message["key"] == MOTION:
            self.say(_messages.LocalStorageGetItemResponseMessage(REDUCED, None, message["request_uuid"]))
        else:
            super()._take(message)

    def label(self, words: str) -> str:
        found: list[str | None] = []
        assert eventually(lambda: found.append(self.find(words)) or found[-1] is not None), words
        return str(found[-1])


def says(page: Reader, word: str) -> bool:
    """Returns whether the line has contained a word."""
    return any("textContent =" in each and word in each.lower() for each in page.scripts)


def test_a_page_without_a_mouse() -> None:
    """The page begins paused, because its browser asks for less motion. A field moves the target by a
    centimetre, and a button turns it by 5°. A sentence says that the simulation runs: to
    screen readers, and on the screen if these sentences are switched on."""
    with served("iiwa14-hold") as server, Reader(server.link) as page:
        assert eventually(lambda: bool(server.sessions.learners), 60.0)
        learner = server.sessions.learners[0]

        def targets() -> dict[str, np.ndarray]:
            return {} if learner.status is None else learner.status.targets

        assert eventually(lambda: learner.status is not None and not learner.status.running)
        assert any("prefers-reduced-motion" in each for each in page.scripts)
        x, y, start = page.label("Target x [m]"), page.label("Target y [m]"), dict(targets())
        assert eventually(lambda: page.controls[x]["value"] == pytest.approx(start["position"][0], abs=1e-3))
        assert page.controls[y]["props"]["step"] == 0.01
        assert eventually(lambda: says(page, "paused"))
        page.press_key("space")
        assert eventually(lambda: says(page, "running"))
        page.write(y, value=round(float(start["position"][1]) + 0.01, 3))
        assert eventually(lambda: targets()["position"][1] - start["position"][1] > 0.008)
        assert np.abs(targets()["position"] - start["position"]).max() < 0.012
        page.write(page.label("Turn"), value="+z")
        assert eventually(lambda: not np.allclose(targets()["orientation"], start["orientation"], atol=0.05))
        looks = [each for each in page.scripts if "cssText" in each and "aria-live" in each]
        assert all("width:1px" in each for each in looks), "only for screen readers"
        page.write(page.label("Say what happens"), value=True)
        assert eventually(lambda: "left:50%" in page.scripts[-1])

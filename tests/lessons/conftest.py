"""Fixtures: the scene with which most tests of the session start, and all runs of the course."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from lessons.scenes.catalog import torque_scene
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession

if TYPE_CHECKING:
    from course_runs import CourseRuns


@pytest.fixture(scope="module")
def scene() -> TorqueScene:
    return torque_scene("iiwa14-hold")


@pytest.fixture
def session(scene: TorqueScene) -> TorqueSession:
    return TorqueSession(scene)


@pytest.fixture(scope="session")
def course_runs(request: pytest.FixtureRequest) -> CourseRuns:
    """The runs of the lessons, of their notes, and of the notes of documents that a test of this session
    judges."""
    from course_runs import course_runs as made

    judged = [item.nodeid for item in request.session.items]

    def lessons(test: str) -> list[str]:
        return [node.partition("[")[2][:-1] for node in judged if f"::{test}[" in node]

    return made(
        lessons("test_everything_a_lesson_claims_is_so"),
        lessons("test_the_notes_of_a_lesson_are_so"),
        bool(lessons("test_a_run_allows_a_sentence_of_a_document")),
    )

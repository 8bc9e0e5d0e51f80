"""Fixtures: the scene with which most tests of the session start, and all runs of the course."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from lessons.scenes.catalog import torque_scene
from lessons.scenes.torque_scene import TorqueScene
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
def course_runs() -> CourseRuns:
    from course_runs import course_runs as made

    return made()

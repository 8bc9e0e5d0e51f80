"""The scene most tests of the session start from."""

from __future__ import annotations

import pytest

from lessons.scenes.catalog import torque_scene
from lessons.scenes.torque_scene import TorqueScene
from lessons.session.torque import TorqueSession


@pytest.fixture(scope="module")
def scene() -> TorqueScene:
    return torque_scene("iiwa14-hold")


@pytest.fixture
def session(scene: TorqueScene) -> TorqueSession:
    return TorqueSession(scene)

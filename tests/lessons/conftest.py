"""The scene most tests of the session start from."""

from __future__ import annotations

import pytest

from lessons.scenes.catalog import load_scene
from lessons.scenes.torque_scene import Scene
from lessons.session.torque import Session


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("iiwa14-hold")


@pytest.fixture
def session(scene: Scene) -> Session:
    return Session(scene)

"""The scene most tests of the session start from."""

from __future__ import annotations

import pytest

from lessons.scene import Scene
from lessons.scenes import load_scene
from lessons.session import Session


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("iiwa14-hold")


@pytest.fixture
def session(scene: Scene) -> Session:
    return Session(scene)

"""The camera that goes along with a mobile base."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from app.view.follow import FollowBase


def test_the_camera_keeps_its_place_beside_the_base() -> None:
    """It moves as the base does, what is turned stays turned, and it stays where it is when let go."""
    camera: Any = SimpleNamespace(position=np.array([3.0, 0.0, 1.0]), look_at=np.array([0.0, 0.0, 0.5]))
    follower = FollowBase(camera)
    follower.follow(np.array([5.0, 0.0, 0.0]), on=False)
    follower.follow(np.array([0.0, 0.0, 0.0]), on=True)
    np.testing.assert_array_equal(camera.position, [3.0, 0.0, 1.0])
    for x in np.linspace(0.0, 1.0, 101):
        follower.follow(np.array([x, 0.0, 0.0]), on=True)
    np.testing.assert_allclose(camera.position, [4.0, 0.0, 1.0], atol=0.021)
    np.testing.assert_allclose(camera.look_at, [1.0, 0.0, 0.5], atol=0.021)
    camera.position = camera.position + np.array([0.0, 2.0, 0.0])
    follower.follow(np.array([1.0, 1.0, 0.0]), on=True)
    np.testing.assert_allclose(camera.position, [4.0, 3.0, 1.0], atol=0.021)
    before = camera.position
    follower.follow(np.array([9.0, 9.0, 0.0]), on=False)
    follower.follow(np.array([9.0, 9.0, 0.0]), on=True)
    np.testing.assert_array_equal(camera.position, before)

"""The camera that follows a mobile base."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from served import served

from app.link.messages import Post
from app.view.camera import FollowBase
from browsing.wire import Wire, eventually
from lessons.events import MoveTarget


def test_the_camera_keeps_its_place_beside_the_base() -> None:
    """The camera is translated with the base, keeps rotations and translations of the user, and stays in
    place when following ends."""
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


def test_a_browser_that_tells_late_where_it_looks_from_loses_nothing() -> None:
    """A browser that reports its camera three steps late loses no step."""
    camera: Any = SimpleNamespace(position=np.array([3.0, 0.0, 1.0]), look_at=np.array([0.0, 0.0, 0.5]))
    follower = FollowBase(camera)
    shown = [(camera.position, camera.look_at)]
    for x in np.linspace(0.0, 1.0, 41):
        follower.follow(np.array([x, 0.0, 0.0]), on=True)
        shown.append((camera.position, camera.look_at))
        camera.position, camera.look_at = shown[max(0, len(shown) - 4)]
    np.testing.assert_allclose(shown[-1][0], [4.0, 0.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(shown[-1][1], [1.0, 0.0, 0.5], atol=1e-9)


def test_what_is_looked_at_can_be_moved_between_two_drives() -> None:
    camera: Any = SimpleNamespace(position=np.array([3.0, 0.0, 1.0]), look_at=np.array([0.0, 0.0, 0.5]))
    follower = FollowBase(camera)
    for x in (0.0, 1.0):
        follower.follow(np.array([x, 0.0, 0.0]), on=True)
    aside = np.array([0.0, 2.0, 0.0])
    camera.position, camera.look_at = camera.position + aside, camera.look_at + aside
    for _ in range(100):
        follower.follow(np.array([1.0, 0.0, 0.0]), on=True)
    follower.follow(np.array([2.0, 0.0, 0.0]), on=True)
    np.testing.assert_allclose(camera.position, [5.0, 2.0, 1.0])
    np.testing.assert_allclose(camera.look_at, [2.0, 2.0, 0.5])


def test_the_page_of_a_mobile_robot_goes_along_once_it_is_asked() -> None:
    with served("ridgeback-ur10-drag") as server, Wire(server.link) as page:
        assert eventually(lambda: page.find("Camera follows the base") is not None and page.eye != ())
        learner = server.sessions.learners[0]

        def base() -> np.ndarray:
            found = learner.read(lambda _, history: history.latest[history.layout.fields["x/base"]])
            return np.full(2, np.nan) if found is None else found.copy()

        assert eventually(lambda: bool(np.isfinite(base()).all()))
        start, eye = base(), np.array(page.eye)
        page.write(page.find("Camera follows the base") or "", value=True)
        learner.send(Post(MoveTarget("base", (float(start[0]), float(start[1]) - 1.0))))
        assert eventually(lambda: bool(np.linalg.norm(base() - start) > 0.8))
        assert eventually(lambda: np.allclose((np.array(page.eye) - eye)[:2], base() - start, atol=0.03))

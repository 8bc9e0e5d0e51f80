"""The camera: all points are in the picture, in the middle of the part that no panel covers; and it follows a
mobile base."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from served import visited

from app.link.choice import SceneChoice
from app.link.messages import Post
from app.view.camera import FollowBase, fit, look, turn
from app.view.robot import aim
from app.worker.simulation import SimulationRunner
from browsing.wire import eventually
from lessons.events import MoveTarget
from lessons.scenes.run_spec import RunSpec
from robots import load_robot


class Camera(SimpleNamespace):
    """The camera of a page with a canvas. It raises ValueError where viser does."""

    position: np.ndarray
    look_at: np.ndarray
    fov, up_direction = 0.9, (0.0, 0.0, 1.0)
    image_width, image_height = 900, 600

    def __setattr__(self, name: str, value: Any) -> None:
        other = {"position": "look_at", "look_at": "position"}.get(name)
        if other and (not np.isfinite(value).all() or np.array_equal(value, vars(self)[other])):
            raise ValueError(name)
        super().__setattr__(name, value)

    @property
    def aspect(self) -> float:
        return self.image_width / self.image_height


def camera(position: Any, look_at: Any, **more: Any) -> Any:
    return Camera(position=np.asarray(position, float), look_at=np.asarray(look_at, float), **more)


SHEET = 0.2
"""Upper edge of viser's sheet on a phone, in a picture from −1 to 1: the sheet covers three fifths."""


def on_picture(points: np.ndarray, eye: np.ndarray, at: np.ndarray, fov: float, aspect: float) -> np.ndarray:
    """Returns the coordinates of points in a picture from −1 to 1, (k, 2), of a pinhole camera."""
    back = (eye - at) / np.linalg.norm(eye - at)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    seen = (points - eye) @ np.array([right, np.cross(back, right), -back]).T
    assert (seen[:, 2] > 0).all()
    return seen[:, :2] / seen[:, 2:] / math.tan(0.5 * fov) / [aspect, 1.0]


@pytest.mark.parametrize("aspect", [0.4, 0.75, 1.6])
@pytest.mark.parametrize("size", [0.3, 2.0])
def test_all_of_it_is_seen_and_in_the_middle(aspect: float, size: float) -> None:
    rng = np.random.default_rng(2)
    points = rng.uniform(-size, size, (9, 3)) + np.array([3.0, -1.0, 0.5])
    direction = np.array([0.95, -0.95, 0.5])
    seen = on_picture(points, *fit(points, direction, 0.9, aspect), 0.9, aspect)
    assert np.abs(seen).max() < 0.8 and np.ptp(seen, axis=0).max() > 0.6
    low, high = seen.min(axis=0), seen.max(axis=0)
    assert np.abs(0.5 * (low + high)).max() < 0.15


@pytest.mark.parametrize("aspect", [0.46, 0.75])
@pytest.mark.parametrize(("above", "below"), [(0.0, 0.0), (0.35, 0.0), (0.0, 0.4), (0.2, 0.6)])
def test_it_is_between_the_panels_over_the_scene(above: float, below: float, aspect: float) -> None:
    points = np.random.default_rng(2).uniform(-0.5, 0.5, (9, 3))
    seen = on_picture(
        points, *fit(points, np.array([0.9, -0.9, 0.5]), 0.9, aspect, above, below), 0.9, aspect
    )
    assert seen[:, 1].min() > 2.0 * below - 1.0 and seen[:, 1].max() < 1.0 - 2.0 * above
    assert np.abs(seen[:, 0]).max() < 1.0


@pytest.mark.parametrize("phone", [False, True])
def test_what_the_hand_will_follow_is_in_the_picture(phone: bool) -> None:
    body = SimulationRunner(SceneChoice(RunSpec("iiwa14-circle")))
    (way,) = [task.path for task in body.ready().tasks if task.kind == "position"]
    body.close()
    assert way is not None
    eye = camera(np.ones(3), np.zeros(3), image_width=460, image_height=1000)
    aim(eye, load_robot("iiwa14"), phone, np.zeros((0, 3)), [way])
    seen = on_picture(way, eye.position, eye.look_at, eye.fov, eye.aspect)
    assert np.abs(seen).max() < 1.0 and (seen[:, 1].min() > SHEET or not phone)


@pytest.mark.parametrize(("width", "height"), [(0, 0), (900, 0), (0, 900), (900, 600)])
@pytest.mark.parametrize("phone", [False, True])
def test_a_robot_is_looked_at_whatever_the_canvas(width: int, height: int, phone: bool) -> None:
    seen = camera(np.ones(3), np.zeros(3), image_width=width, image_height=height)
    aim(seen, load_robot("planar3"), phone, np.zeros((0, 3)))
    assert np.linalg.norm(seen.position - seen.look_at) < 100.0


def test_a_camera_that_looks_at_where_it_is_is_turned_all_the_same() -> None:
    seen = camera(np.ones(3), np.ones(3))
    look(seen, np.eye(3), False, None)
    assert np.isfinite(seen.position).all()


@pytest.mark.parametrize("position", [(5.0, 5.0, 5.0), (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0)])
def test_a_camera_that_looks_at_where_it_will_be_is_turned(position: tuple[float, ...]) -> None:
    eye, at = np.array([1.0, 0.0, 0.0]), np.zeros(3)
    seen = camera(position, eye)
    turn(seen, eye, at)
    assert np.array_equal(seen.position, eye) and np.array_equal(seen.look_at, at)


def test_the_camera_keeps_its_place_beside_the_base() -> None:
    """The camera is translated with the base, keeps rotations and translations of the user, and stays in
    place when following ends."""
    eye = camera([3.0, 0.0, 1.0], [0.0, 0.0, 0.5])
    follower = FollowBase(eye)
    follower.follow(np.array([5.0, 0.0, 0.0]), on=False)
    follower.follow(np.array([0.0, 0.0, 0.0]), on=True)
    np.testing.assert_array_equal(eye.position, [3.0, 0.0, 1.0])
    for x in np.linspace(0.0, 1.0, 101):
        follower.follow(np.array([x, 0.0, 0.0]), on=True)
    np.testing.assert_allclose(eye.position, [4.0, 0.0, 1.0], atol=0.021)
    np.testing.assert_allclose(eye.look_at, [1.0, 0.0, 0.5], atol=0.021)
    eye.position = eye.position + np.array([0.0, 2.0, 0.0])
    follower.follow(np.array([1.0, 1.0, 0.0]), on=True)
    np.testing.assert_allclose(eye.position, [4.0, 3.0, 1.0], atol=0.021)
    before = eye.position
    follower.follow(np.array([9.0, 9.0, 0.0]), on=False)
    follower.follow(np.array([9.0, 9.0, 0.0]), on=True)
    np.testing.assert_array_equal(eye.position, before)


def test_a_browser_that_tells_late_where_it_looks_from_loses_nothing() -> None:
    """A browser that reports its camera three steps late loses no step."""
    eye = camera([3.0, 0.0, 1.0], [0.0, 0.0, 0.5])
    follower = FollowBase(eye)
    shown = [(eye.position, eye.look_at)]
    for x in np.linspace(0.0, 1.0, 41):
        follower.follow(np.array([x, 0.0, 0.0]), on=True)
        shown.append((eye.position, eye.look_at))
        eye.position, eye.look_at = shown[max(0, len(shown) - 4)]
    np.testing.assert_allclose(shown[-1][0], [4.0, 0.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(shown[-1][1], [1.0, 0.0, 0.5], atol=1e-9)


def test_what_is_looked_at_can_be_moved_between_two_drives() -> None:
    eye = camera([3.0, 0.0, 1.0], [0.0, 0.0, 0.5])
    follower = FollowBase(eye)
    for x in (0.0, 1.0):
        follower.follow(np.array([x, 0.0, 0.0]), on=True)
    aside = np.array([0.0, 2.0, 0.0])
    eye.position, eye.look_at = eye.position + aside, eye.look_at + aside
    for _ in range(100):
        follower.follow(np.array([1.0, 0.0, 0.0]), on=True)
    follower.follow(np.array([2.0, 0.0, 0.0]), on=True)
    np.testing.assert_allclose(eye.position, [5.0, 2.0, 1.0])
    np.testing.assert_allclose(eye.look_at, [2.0, 2.0, 0.5])


def test_the_page_of_a_mobile_robot_goes_along_once_it_is_asked() -> None:
    with visited("ridgeback-ur10-drag") as (page, learner):
        assert eventually(lambda: page.find("Camera follows the base") is not None and page.eye != ())

        def base() -> np.ndarray:
            found = learner.read(lambda run: run.latest[run.layout.fields["x/base"]])
            return np.full(2, np.nan) if found is None else found.copy()

        assert eventually(lambda: bool(np.isfinite(base()).all()))
        start, eye = base(), np.array(page.eye)
        page.write(page.find("Camera follows the base") or "", value=True)
        learner.send(Post(MoveTarget("base", (float(start[0]), float(start[1]) - 1.0))))
        assert eventually(lambda: bool(np.linalg.norm(base() - start) > 0.8))
        assert eventually(lambda: np.allclose((np.array(page.eye) - eye)[:2], base() - start, atol=0.03))

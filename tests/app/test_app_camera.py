"""The camera's view: all points are in the picture, in the middle of the part that no panel covers."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.link.choice import SceneChoice
from app.view.camera import fit
from app.view.robot import aim
from app.worker.simulation import SimulationRunner
from lessons.scenes.run_spec import RunSpec
from robots import load_robot

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
    size = {"image_width": 460, "image_height": 1000, "aspect": 0.46}
    camera: Any = SimpleNamespace(position=np.ones(3), look_at=np.zeros(3), fov=0.9, **size)
    aim(camera, load_robot("iiwa14"), phone, np.zeros((0, 3)), [way])
    seen = on_picture(way, camera.position, camera.look_at, camera.fov, camera.aspect)
    assert np.abs(seen).max() < 1.0 and (seen[:, 1].min() > SHEET or not phone)

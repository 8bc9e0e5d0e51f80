"""Where to look from, so that all of something is seen."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import viser

_SHARE = 0.74
"""Of the picture's width and height that what is looked at may take: a target has to be dragged somewhere."""
_NARROW = 0.75
"""Width over height of a desktop's scene once the panels are docked beside it, as a rule."""
_SLIM = 0.2
"""Width over height below which no more is made of it: the camera would go far away."""
_ASIDE = np.array([1.0, 0.75, 0.55])
"""From where to look if nothing else is known."""
_THICK = 0.07
"""How far links reach around their joints, as a share of the robot's size."""
_SHEET = 0.6
"""Of a phone's height that viser's sheet covers, from below."""


def fit(
    points: np.ndarray, direction: np.ndarray, fov: float, aspect: float, phone: bool
) -> tuple[np.ndarray, np.ndarray]:
    """(position, look_at) of a camera that sees all points in the middle of what is free of its picture.

    Args:
        points: (k, 3) m.
        direction: (3,) from what is looked at to the camera; not straight up or down.
        fov: vertical opening, rad.
        aspect: width over height.
        phone: whether a sheet covers the lower part.
    """
    back = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    size = max(float(np.ptp(points, axis=0).max()), 0.2)
    seen = points @ np.array([right, up, back]).T
    middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    away = np.abs(seen[:, :2] - middle[:2]) + _THICK * size
    high = math.tan(0.5 * fov)
    open_ = np.array([high * aspect, high * (1.0 - _SHEET if phone else 1.0)])
    distance = float((away / (_SHARE * open_) + (seen[:, 2:] - middle[2])).max())
    at = middle @ np.array([right, up, back])
    if phone:
        at = at - _SHEET * distance * high * up
    return at + distance * back, at


def look(camera: viser.CameraHandle, points: np.ndarray, phone: bool, direction: np.ndarray | None) -> None:
    """Turns the camera to all points (k, 3), m; direction: from there to it, None: as it is now."""
    if direction is None:
        here = np.asarray(camera.position, float) - np.asarray(camera.look_at, float)
        level = float(np.linalg.norm(here[:2]))
        # Straight from above there is no up; so far down it is nearly the same.
        below = np.array([0.0, 0.05 * abs(here[2]), 0.0])
        direction = here if level > 0.02 * abs(float(here[2])) else here - below
    if not np.linalg.norm(direction) > 0.0:
        direction = _ASIDE
    # A page that is folded away, or not laid out yet, has no height or no width.
    aspect = max(max(camera.image_width, 1) / max(camera.image_height, 1), _SLIM)
    eye, at = fit(points, np.asarray(direction), camera.fov, aspect if phone else min(aspect, _NARROW), phone)
    camera.up_direction = (0.0, 0.0, 1.0)
    turn(camera, eye, at)


def turn(camera: viser.CameraHandle, eye: np.ndarray, at: np.ndarray) -> None:
    """Puts the camera to `eye` and lets it look at `at`, two places, (3,) m."""
    for share in (1.0, 2.0, 3.0):
        with contextlib.suppress(ValueError):
            camera.position = eye
            camera.look_at = at
            return
        # viser moves one after the other, and refuses a camera that looks at where it is between the two;
        # what the browser tells of its own camera may come in at any moment.
        with contextlib.suppress(ValueError):
            camera.look_at = np.asarray(camera.position, float) + share * (eye - at)

"""The camera: poses from which all given points are visible, and following a mobile base."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import viser

_SHARE = 0.74
"""Share of the picture's width and height that the points may fill; the rest is room for dragging a
target."""
_NARROW = 0.75
"""Usual ratio of width to height of the scene on a desktop, with the panels docked beside it."""
_SLIM = 0.2
"""Smallest ratio of width to height that is used. With a smaller ratio the camera would be too far away."""
_ASIDE = np.array([1.0, 0.75, 0.55])
"""Default direction from the points to the camera."""
_THICK = 0.07
"""Distance that links extend around their joints, as a share of the robot's size."""
_SHEET = 0.6
"""Share of a phone's height, from below, that viser's sheet covers."""
_MOST = 0.4
"""Largest share of the picture's height that is left to a panel above or below: the robot would be too
small."""
_STEP = 0.02
"""Motion of the base, m, below which the camera stays, since a trembling camera is unpleasant."""
_REST = 30
"""Number of calls with the base at rest after which the browser's last camera message is up to date."""


def fit(
    points: np.ndarray,
    direction: np.ndarray,
    fov: float,
    aspect: float,
    above: float = 0.0,
    below: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns (position, look_at) of a camera that shows all points in the middle of the free part of its
    picture.

    Args:
        points: (k, 3) m.
        direction: (3,) from the points to the camera; not vertical.
        fov: vertical opening angle, rad.
        aspect: width over height.
        above, below: shares of the picture's height that panels cover from above and from below.
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
    open_ = np.array([high * aspect, high * (1.0 - below - above)])
    distance = float((away / (_SHARE * open_) + (seen[:, 2:] - middle[2])).max())
    at = middle @ np.array([right, up, back])
    at = at + (above - below) * distance * high * up
    return at + distance * back, at


def covered_shares(
    camera: viser.CameraHandle, phone: bool, covered: tuple[float, float]
) -> tuple[float, float]:
    """Returns the shares of the picture's height that panels cover from above and from below. covered: the
    panels' heights, px; phone: whether viser's sheet covers the lower part."""
    above, below = (min(height / max(camera.image_height, 1), _MOST) for height in covered)
    return above, _SHEET if phone else below


def look(
    camera: viser.CameraHandle,
    points: np.ndarray,
    phone: bool,
    direction: np.ndarray | None,
    covered: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Moves the camera so that all points (k, 3), m, are visible. direction: from the points to the camera;
    None for the present direction. covered: heights of the panels that cover the picture from above and
    from below, px."""
    if direction is None:
        here = np.asarray(camera.position, float) - np.asarray(camera.look_at, float)
        level = float(np.linalg.norm(here[:2]))
        # For a vertical viewing direction the upward direction is undefined; this steep direction looks
        # nearly the same.
        below = np.array([0.0, 0.05 * abs(here[2]), 0.0])
        direction = here if level > 0.02 * abs(float(here[2])) else here - below
    if not np.linalg.norm(direction) > 0.0:
        direction = _ASIDE
    # The canvas of a folded page, or of a page without a layout, has zero height or width.
    aspect = max(max(camera.image_width, 1) / max(camera.image_height, 1), _SLIM)
    width = aspect if phone else min(aspect, _NARROW)
    shares = covered_shares(camera, phone, covered)
    eye, at = fit(points, np.asarray(direction), camera.fov, width, *shares)
    camera.up_direction = (0.0, 0.0, 1.0)
    turn(camera, eye, at)


def turn(camera: viser.CameraHandle, eye: np.ndarray, at: np.ndarray) -> None:
    """Moves the camera to `eye` and turns it to `at`, both (3,) m."""
    for share in (1.0, 2.0, 3.0):
        with contextlib.suppress(ValueError):
            camera.position = eye
            camera.look_at = at
            return
        # viser changes position and look_at one after the other and raises an error if they coincide in
        # between. The browser's own messages about its camera may arrive at any moment.
        with contextlib.suppress(ValueError):
            camera.look_at = np.asarray(camera.position, float) + share * (eye - at)


class FollowBase:
    """Moves a page's camera along with the base; the viewing direction remains the learner's choice.

    A browser's camera message is late: while the base moves, the message is some pictures old, and its
    position lacks the motion since then. Therefore only the direction and distance of the camera are taken
    from the message while the base moves; following the base does not change them. The point that the
    camera looks at is taken from the message only while the base is at rest.
    """

    def __init__(self, camera: viser.CameraHandle) -> None:
        self._camera = camera
        self._at: np.ndarray | None = None
        self._ahead = np.zeros(3)
        self._rests = 0

    def follow(self, base: np.ndarray, on: bool) -> None:
        """base: the base's position, (3,) m; on: whether the camera follows the base. When `on` becomes
        true, the motion is measured from the present position."""
        if not on:
            self._at = None
            return
        if self._at is None:
            self._at, self._rests = base.copy(), _REST
        if np.linalg.norm(base - self._at) < _STEP:
            self._rests += 1
            return
        look = self._camera.look_at - self._camera.position
        if self._rests >= _REST:
            self._ahead = self._camera.look_at - self._at
        self._at, self._rests = base.copy(), 0
        point = base + self._ahead
        turn(self._camera, point - look, point)

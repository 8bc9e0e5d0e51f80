"""The camera goes along with a mobile base, so that a robot that drives off stays in the picture."""

from __future__ import annotations

import numpy as np
import viser

from app.view.camera import turn

_STEP = 0.02
"""m: a base that moved less is not followed yet; a camera that trembles with it is hard to look through."""
_REST = 30
"""Calls while the base stands, after which the browser has long told where the learner looks."""


class FollowBase:
    """Moves a page's camera by what the base moved; from where it looks stays the learner's choice.

    What a browser tells of its camera is late: while the base moves, it is from a few pictures ago, and what
    is added to that loses what came meanwhile. Only how the camera looks at its point, which following leaves
    as it is, is taken from there; the point itself once the base stands.
    """

    def __init__(self, camera: viser.CameraHandle) -> None:
        self._camera = camera
        self._at: np.ndarray | None = None
        self._ahead = np.zeros(3)
        self._rests = 0

    def follow(self, base: np.ndarray, on: bool) -> None:
        """base: where it is, (3,) m; on: whether it is followed, from where it is when that begins."""
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

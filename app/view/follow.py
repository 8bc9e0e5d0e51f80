"""The camera follows a mobile base, so that a moving robot stays in the picture."""

from __future__ import annotations

import numpy as np
import viser

from app.view.camera import turn

_STEP = 0.02
"""Motion of the base, m, below which the camera stays, since a trembling camera is unpleasant."""
_REST = 30
"""Number of calls with the base at rest after which the browser's last camera message is up to date."""


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

"""The camera goes along with a mobile base, so that a robot that drives off stays in the picture."""

from __future__ import annotations

import numpy as np
import viser

_STEP = 0.02
"""m: a base that moved less is not followed yet; a camera that trembles with it is hard to look through."""


class FollowBase:
    """Moves a page's camera by what the base moved; from where it looks stays the learner's choice."""

    def __init__(self, camera: viser.CameraHandle) -> None:
        self._camera = camera
        self._at: np.ndarray | None = None

    def follow(self, base: np.ndarray, on: bool) -> None:
        """base: where it is, (3,) m; on: whether it is followed, from where it is when that begins."""
        if not on:
            self._at = None
        elif self._at is None:
            self._at = base.copy()
        elif np.linalg.norm(base - self._at) >= _STEP:
            moved, self._at = base - self._at, base.copy()
            eye, at = self._camera.position + moved, self._camera.look_at + moved
            self._camera.position = eye
            self._camera.look_at = at

"""Curves in the 3D view: the reference, the path of the hand, and the controller's prediction."""

from __future__ import annotations

import numpy as np
import viser

from app.adapter import private
from app.client.recording import decimate
from app.html.palette import LEVELS, RGB

EXAGGERATION = 100
"""Magnification of the prediction at torque level. Without it, the prediction of some milliseconds would look
like a dot."""


def segments(points: np.ndarray) -> np.ndarray:
    """Returns a curve (k, 3) as line segments (k − 1, 2, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


def trace(tips: np.ndarray) -> np.ndarray:
    """Returns the path (k, 3) of a hand, m, as segments, without the inner points of straight parts."""
    return segments(tips[decimate(tips.T, _FINE)]) if len(tips) > 1 else NOTHING


NOTHING = np.zeros((1, 2, 3), np.float32)
_FINE = 1e-3  # m: half a pixel


class Trails:
    """Reference curves (drawn once), trace and prediction (updated about ten times a second)."""

    def __init__(
        self,
        scene: viser.SceneApi,
        curves: list[tuple[np.ndarray, RGB]],
        colour: RGB,
        name: str = "",
        scale: int = EXAGGERATION,
    ) -> None:
        """name: distinguishes the nodes of several trails; scale: factor by which predicted motions are
        enlarged."""
        self._scale = scale
        for index, (points, curve_colour) in enumerate(curves):
            scene.add_line_segments(
                f"/reference{name}/{index}", segments(points), curve_colour, thickness=0.003
            )
        self._trace = scene.add_line_segments(f"/trace{name}", NOTHING, colour, thickness=0.004)
        self._prediction = scene.add_line_segments(f"/prediction{name}", NOTHING, LEVELS[4], thickness=0.008)
        self._label = scene.add_label(f"/prediction_label{name}", "", visible=False, anchor="top-center")

    def show(self, trace: bool, prediction: bool) -> None:
        self._trace.visible = trace
        self._prediction.visible = prediction
        if not prediction:
            self._label.visible = False

    def draw(self, tips: np.ndarray, path: np.ndarray, T_s: float) -> None:
        """tips (k, 3): the path of the hand so far; path (N + 1, 3): the predicted path of the tip."""
        if self._trace.visible:
            self._trace.points = trace(tips)
        if not self._prediction.visible:
            return
        if len(path) < 2 or not np.isfinite(path).all():
            self._prediction.points = NOTHING
            self._label.visible = False
            return
        larger = path[0] + self._scale * (path - path[0])
        self._prediction.points = segments(larger)
        moving = self._scale > 1 and bool(np.linalg.norm(larger[-1] - larger[0]) > 0.03)
        self._label.visible = moving
        if moving:
            private.shift(self._label, larger[-1])
            milliseconds = 1e3 * T_s * (len(path) - 1)
            self._label.text = f"predicted {milliseconds:g} ms, motion × {self._scale}"

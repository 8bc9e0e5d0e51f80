"""Curves in the scene: the reference, the way the hand went, and the controller's prediction."""

from __future__ import annotations

from collections import deque

import numpy as np
import viser

from app.palette import RGB

TRACE_SECONDS = 6.0
_TRACE_POINTS = 240
EXAGGERATION = 100
"""At torque level the prediction reaches some milliseconds ahead: at true scale it would be a dot."""


def _segments(points: np.ndarray) -> np.ndarray:
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


_NOTHING = np.zeros((1, 2, 3), np.float32)


class Trails:
    """Reference curves (drawn once), trace and prediction (renewed about ten times a second)."""

    def __init__(
        self,
        scene: viser.SceneApi,
        curves: list[tuple[np.ndarray, RGB]],
        colour: RGB,
        name: str = "",
        scale: int = EXAGGERATION,
    ) -> None:
        """name: sets the nodes of several trails apart; scale: by which predicted motions are enlarged."""
        self._scale = scale
        for index, (points, curve_colour) in enumerate(curves):
            scene.add_line_segments(
                f"/reference{name}/{index}", _segments(points), curve_colour, thickness=0.003
            )
        self._trace = scene.add_line_segments(f"/trace{name}", _NOTHING, colour, thickness=0.004)
        self._prediction = scene.add_line_segments(
            f"/prediction{name}", _NOTHING, (225, 29, 116), thickness=0.008
        )
        self._label = scene.add_label(f"/prediction_label{name}", "", visible=False)
        self._points: deque[np.ndarray] = deque(maxlen=_TRACE_POINTS)
        self._times: deque[float] = deque(maxlen=_TRACE_POINTS)

    def show(self, trace: bool, prediction: bool) -> None:
        self._trace.visible = trace
        self._prediction.visible = prediction
        if not prediction:
            self._label.visible = False

    def clear(self) -> None:
        self._points.clear()
        self._times.clear()
        self._trace.points = _NOTHING

    def add(self, t: float, tip: np.ndarray) -> None:
        """The actual tip (3,) at simulated time t."""
        if self._times and t <= self._times[-1]:
            if t < self._times[-1]:
                self.clear()
            return
        self._points.append(tip.copy())
        self._times.append(t)
        while self._times and t - self._times[0] > TRACE_SECONDS:
            self._points.popleft()
            self._times.popleft()

    def draw(self, path: np.ndarray, T_s: float) -> None:
        """path (N + 1, 3): the predicted tip."""
        if len(self._points) > 1:
            self._trace.points = _segments(np.array(self._points))
        if not self._prediction.visible:
            return
        if len(path) < 2 or not np.isfinite(path).all():
            self._prediction.points = _NOTHING
            self._label.visible = False
            return
        larger = path[0] + self._scale * (path - path[0])
        self._prediction.points = _segments(larger)
        moving = self._scale > 1 and bool(np.linalg.norm(larger[-1] - larger[0]) > 0.03)
        self._label.visible = moving
        if moving:
            self._label.position = larger[-1]
            milliseconds = 1e3 * T_s * (len(path) - 1)
            self._label.text = f"predicted {milliseconds:g} ms, motion × {self._scale}"

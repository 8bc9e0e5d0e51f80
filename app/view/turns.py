"""How far each joint has turned since the start of the run, written at the joint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from app.client.recording import PlotWindow

_BEGIN = 0.05
"""Simulated time, s, until which the robot counts as being at its start."""


class JointTurns:
    """A label at each joint, such as "3: 12°"; no labels if the recording does not contain the start."""

    def __init__(self, scene: viser.SceneApi, joints: Sequence[int]) -> None:
        """joints: indices of the joints that get a label, in the order of the poses, from 1 on."""
        self._joints = joints
        self._labels = [scene.add_label(f"/turn/{k}", "", visible=False) for k in joints]
        self._start: np.ndarray | None = None

    def draw(self, t: float, q: np.ndarray, poses: np.ndarray, window: PlotWindow) -> None:
        """t: simulated time, s; q: (n,) rad; poses: (J, 7), of the joints and the tip; window: the
        recording up to this time."""
        if t < _BEGIN:
            self._start = None
        elif self._start is None:
            self._start = _start_of(window)
        start = self._start if np.isfinite(q).all() else None
        for k, label in enumerate(self._labels):
            label.visible = start is not None
            if start is None:
                continue
            turn = abs(np.degrees(q[k] - start[k]))
            text = f"{k + 1}: {turn:.{0 if turn >= 10 else 1}f}°"
            label.text = text
            label.position = tuple(poses[self._joints[k] - 1, :3])


def _start_of(window: PlotWindow) -> np.ndarray | None:
    fields = window.layout.fields
    early = np.flatnonzero(window.columns(fields["t"])[:, 0] < _BEGIN)
    return window.columns(fields["q"])[early[0]] if len(early) else None

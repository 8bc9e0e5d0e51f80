"""How far each joint has turned since the start of the run, written at the joint."""

from __future__ import annotations

import numpy as np
import viser

_BEGIN = 0.05
"""Simulated time, s, until which the robot counts as being at its start."""


class JointTurns:
    """A label at each joint, such as "3: 12°"; without labels until the start of a run was seen."""

    def __init__(self, scene: viser.SceneApi, joints: int) -> None:
        self._labels = [scene.add_label(f"/turn/{k}", "", visible=False) for k in range(1, joints + 1)]
        self._start: np.ndarray | None = None

    def draw(self, t: float, q: np.ndarray, poses: np.ndarray) -> None:
        """t: simulated time, s; q: (n,) rad; poses: (n + 1, 7), of the joints and the tip."""
        if t < _BEGIN:
            self._start = np.array(q)
        if self._start is None:
            return
        for k, (label, turn) in enumerate(zip(self._labels, np.degrees(q - self._start), strict=True)):
            label.visible = t >= _BEGIN
            label.position = tuple(poses[k, :3])
            text = f"{k + 1}: {abs(turn):.{0 if abs(turn) >= 10 else 1}f}°"
            if label.text != text:
                label.text = text

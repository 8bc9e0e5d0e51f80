"""The ghost in the scene: a translucent robot of one colour, its trace and its name."""

from __future__ import annotations

import numpy as np
import viser

from app.client.moment import GhostState
from app.html.palette import GHOST
from app.view.robot import RobotView
from app.view.trails import NOTHING, trace
from robots import Robot

_OPACITY = 0.38


class GhostView:
    """The 3D view of the ghost; it exists while there is a ghost."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, words: str) -> None:
        self._root = scene.add_frame("/ghost", show_axes=False)
        self._robot = RobotView(scene, robot, "/ghost", GHOST, _OPACITY)
        self._trace = scene.add_line_segments("/ghost/trace", NOTHING, GHOST, thickness=0.004)
        self._label = scene.add_label("/ghost/label", f"ghost: {words}")

    def move(self, ghost: GhostState) -> None:
        self._robot.move(ghost.poses[:-1])
        at = ghost.poses[-1, :3] + np.array([0.0, 0.0, 0.08])
        if not np.allclose(at, self._label.position, atol=1e-4):
            self._label.position = at

    def draw(self, ghost: GhostState) -> None:
        """Draws the trace, about ten times per second."""
        self._trace.points = trace(ghost.way[:, -1, :3]) if len(ghost.way) else NOTHING

    def remove(self) -> None:
        self._root.remove()

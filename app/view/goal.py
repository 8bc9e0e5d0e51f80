"""A goal of the robot's hand in space or of its base on the floor. Some goals can be dragged."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np
import viser

from app.client.pending_edit import HOLD
from app.html.palette import RGB

_BALL = 0.07  # m
_DISC = 0.22  # m
_GAP = 0.03  # m: shorter lines to the goal are not drawn
_LIFT = 0.01  # m above the floor


class Goal:
    """A ball, or a disc for a goal on the floor; a line from the controlled point; a label; and, if the goal
    can be dragged, arrows along the world's axes.

    The user's drag has priority: for a moment after it, `follow` does not move the goal.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        role: str,
        axes: str,
        colour: RGB,
        start: np.ndarray,
        size: float,
        moved: Callable[[np.ndarray], None] | None,
    ) -> None:
        """start (3,): initial position, m; size: of the arrows, m; moved: called with the goal (3,), m, after
        each move; None if the goal cannot be dragged."""
        floor = "z" not in axes
        self._lift = np.array([0.0, 0.0, _LIFT if floor else 0.0])
        self._touched, self._axes, self._moved = -float("inf"), axes, moved
        node = f"/goal/{role}"
        position = start + self._lift
        if moved is None:
            self._node = scene.add_frame(node, show_axes=False, position=position)
        else:
            self._node = _arrows(scene, node, axes, position, size)
            self._node.on_update(self._listener(moved))
        if floor:
            scene.add_cylinder(
                f"{node}/disc", radius=_DISC, height=0.015, color=colour, opacity=0.6, cast_shadow=False
            )
        else:
            scene.add_icosphere(f"{node}/ball", radius=_BALL, color=colour, opacity=0.8, cast_shadow=False)
        self._label = scene.add_label(f"{node}/label", role, position=(0.0, 0.0, 0.9 * size + 0.06))
        self._gap = scene.add_line_segments(
            f"/gap/{role}", np.zeros((1, 2, 3), np.float32), colour, thickness=0.008, visible=False
        )

    def _listener(self, moved: Callable[[np.ndarray], None]) -> Callable[[Any], Coroutine[Any, Any, None]]:
        async def hear(_: viser.TransformControlsEvent) -> None:
            self._touched = time.monotonic()
            moved(self.place)

        return hear

    def put(self, place: np.ndarray) -> None:
        """Moves the goal as its arrows do, along the directions of the arrows only."""
        if self._moved is not None:
            active = ["xyz".index(axis) for axis in self._axes]
            at = self.place
            at[active] = place[active]
            self._touched = time.monotonic()
            self._node.position = at + self._lift
            self._moved(at)

    @property
    def place(self) -> np.ndarray:
        """The position of the goal, (3,) m."""
        return np.array(self._node.position, float) - self._lift

    def where(self) -> np.ndarray:
        """Returns `place`."""
        return self.place

    def follow(self, goal: np.ndarray | None, text: str) -> None:
        """Updates the goal and its label. goal: the session's goal, (3,) m; None if the session has no goal;
        the goal then stays at the position to which it was dragged."""
        if self._label.text != text:
            self._label.text = text
        if goal is None or time.monotonic() - self._touched < HOLD:
            return
        if not np.allclose(goal, self.place, rtol=0.0, atol=1e-4):
            self._node.position = goal + self._lift

    def reach_from(self, point: np.ndarray) -> None:
        """Draws the line from the controlled point (3,), m, to the goal."""
        ends = np.array([[point + self._lift, self.place + self._lift]], np.float32)
        shown = bool(np.linalg.norm(ends[0, 1] - ends[0, 0]) > _GAP)
        if self._gap.visible != shown:
            self._gap.visible = shown
        if shown and not np.allclose(ends, self._gap.points, rtol=0.0, atol=1e-3):
            self._gap.points = ends


def _arrows(
    scene: viser.SceneApi, node: str, axes: str, position: np.ndarray, size: float
) -> viser.TransformControlsHandle:
    x, y, z = (axis in axes for axis in "xyz")
    return scene.add_transform_controls(
        node,
        scale=size,
        position=position,
        active_axes=(x, y, z),
        disable_rotations=True,
        depth_test=False,
        line_width=3.0,
    )

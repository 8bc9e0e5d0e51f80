"""What a user drags in the 3D view: arrows or rings, the line to them, and the same target moved by code."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser
import viser.transforms as vtf

from app.client.pending_edit import HOLD
from app.html.palette import RGB


class Handle:
    """Arrows along the world's axes, or rings. The user's drag has priority: while `held`, a view does not
    move the handle."""

    def __init__(
        self,
        scene: viser.SceneApi,
        node: str,
        axes: str,
        size: float,
        rings: bool = False,
        **given: Any,
    ) -> None:
        """size: of the arrows or rings, m; given: further attributes of the control."""
        x, y, z = (axis in axes for axis in "xyz")
        look = {"disable_axes": rings, "disable_sliders": rings, "disable_rotations": not rings}
        self._touched = -float("inf")
        self.control = scene.add_transform_controls(
            node, scale=size, active_axes=(x, y, z), depth_test=False, **{"line_width": 3.0, **look, **given}
        )

    def listen(self, moved: Callable[[], object]) -> None:
        """Lets `moved` be called after each move. The owner calls this when all that `moved` needs is there:
        the browser draws the handle before that, and its moves arrive on viser's loop."""

        @self.control.on_update
        async def _(_: viser.TransformControlsEvent) -> None:
            self.touch()
            moved()

    def touch(self) -> None:
        """Called when the handle is moved by a drag or by keys."""
        self._touched = time.monotonic()

    @property
    def held(self) -> bool:
        """Whether the handle was moved a moment ago: the session may not have answered yet."""
        return time.monotonic() - self._touched < HOLD


class Gap:
    """The line from a controlled point to its target; shorter lines than `least`, m, are not drawn."""

    def __init__(
        self, scene: viser.SceneApi, node: str, colour: RGB, thickness: float, least: float = 0.0
    ) -> None:
        start = np.zeros((1, 2, 3), np.float32)
        self._line = scene.add_line_segments(node, start, colour, thickness=thickness, visible=False)
        self._least = least

    def show(self, point: np.ndarray, target: np.ndarray) -> None:
        """Draws the line between two points (3,), m."""
        ends = np.array([[point, target]], np.float32)
        shown = bool(np.linalg.norm(target - point) > self._least)
        if self._line.visible != shown:
            self._line.visible = shown
        if shown and not np.allclose(ends, self._line.points, rtol=0.0, atol=1e-3):
            self._line.points = ends

    def remove(self) -> None:
        self._line.remove()


@dataclass(frozen=True)
class Movable:
    """A target that code moves on viser's loop, with the same effect as a drag of its arrows or rings.

    Attributes:
        name: the name of its task or role.
        place: returns its present position (3,), m; None while it has no position.
        move: moves it to a position (3,), m; None: it can only be turned.
        turn: turns it about the world's axes by a rotation vector (3,), rad; None: it can only be moved.
    """

    name: str
    place: Callable[[], np.ndarray | None]
    move: Callable[[np.ndarray], None] | None = None
    turn: Callable[[np.ndarray], None] | None = None


def turned(rotation: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Returns the rotation (3, 3) followed by a rotation about the world's axes, by the rotation vector (3,),
    rad."""
    return vtf.SO3.exp(by).as_matrix() @ rotation

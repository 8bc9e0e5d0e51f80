"""The dragged target: gizmo, ball, and the position that the controller gets."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser
import viser.transforms as vtf

from app.adapter import private
from app.html.palette import BAD, RGB
from app.link.messages import TaskView

Moved = Callable[[np.ndarray, np.ndarray | None], None]

_BALL = 0.07  # m: the transparent ball is larger than most wrists and encloses them
_FRAME = 0.09  # m
_STILL = 1e-4  # m, and the same number of rad: about a tenth of a pixel
_INVITATION = "drag an arrow"


class TargetGizmo:
    """The control of a target: arrows along the world's axes for a position task, rings for an orientation
    task of the same frame. The rings rotate with the target.

    The ball is at the dragged position. If this position is out of reach, the ball becomes transparent and
    red. A second ball in the task's colour, with a line to it, marks the position that the controller gets
    instead.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        position: TaskView,
        orientation: TaskView | None,
        colour: RGB,
        start: np.ndarray,
        rotation: np.ndarray,
        size: float,
        moved: Moved,
    ) -> None:
        """start (3,): initial position of the target, m; rotation (3, 3); size: of the gizmo, m; moved:
        called with the raw position and, if rings are shown, the raw rotation."""
        self.position, self.orientation = position, orientation
        self._rings = orientation is not None
        x, y, z = (axis in position.axes for axis in "xyz")
        active = (x, y, z)
        self._gizmo = scene.add_transform_controls(
            "/target",
            scale=size,
            position=start,
            active_axes=active,
            disable_rotations=True,
            depth_test=False,
            line_width=3.0,
        )
        self._turn = scene.add_transform_controls(
            "/target/turn",
            scale=size,
            wxyz=_wxyz(rotation),
            active_axes=active,
            disable_axes=True,
            disable_sliders=True,
            depth_test=False,
            line_width=3.0,
            visible=orientation is not None,
        )
        self._ball = scene.add_icosphere(
            "/target/ball", radius=_BALL, color=colour, opacity=0.8, cast_shadow=False
        )
        self._ghost = scene.add_icosphere(
            "/target/ghost", radius=_BALL, color=BAD, opacity=0.45, visible=False, cast_shadow=False
        )
        self._label = scene.add_label("/target/label", _INVITATION, position=(0.0, 0.0, size + 0.05))
        self._said = _INVITATION
        self._invites, self._missing, self._paused = True, 0.0, ""
        self._accepted = scene.add_icosphere(
            "/accepted", radius=_BALL, color=colour, opacity=0.6, visible=False, cast_shadow=False
        )
        self._then = scene.add_icosphere(
            "/target_then", radius=_BALL, color=colour, opacity=0.8, visible=False, cast_shadow=False
        )
        self._gap = scene.add_line_segments(
            "/gap", np.zeros((1, 2, 3), np.float32), BAD, thickness=0.006, visible=False
        )

        @self._gizmo.on_update
        @self._turn.on_update
        async def _(_: viser.TransformControlsEvent) -> None:
            self._invites = False
            self._say()
            moved(self.raw, self.rotation if self._rings else None)

    @property
    def raw(self) -> np.ndarray:
        return np.array(self._gizmo.position, float)

    @property
    def rotation(self) -> np.ndarray:
        return vtf.SO3(np.array(self._turn.wxyz, float)).as_matrix()

    @property
    def turns(self) -> bool:
        """Whether the rings are shown."""
        return self._rings

    def show_rings(self, on: bool) -> None:
        """Shows the rings if the user may rotate the target."""
        on = on and self.orientation is not None
        if on != self._rings:
            self._rings = on
            self._turn.visible = on

    def put(self, position: np.ndarray, rotation: np.ndarray | None) -> None:
        """Moves the gizmo to a position and rotation, for example after a reset."""
        self._gizmo.position = position
        if rotation is not None:
            self._turn.wxyz = _wxyz(rotation)
        self.show_accepted(position, 0.0)

    def show_accepted(self, accepted: np.ndarray, missing: float) -> None:
        """Shows the result of the reachability check: the position that the controller gets, and its distance
        from the dragged position, m."""
        out = missing > 0.0
        for handle in (self._ghost, self._accepted, self._gap):
            handle.visible = out
        self._ball.visible = not out
        self._missing = missing
        if out:
            self._accepted.position = accepted
            self._gap.points = np.array([[self.raw, accepted]], np.float32)
        self._say()

    def pause(self, words: str) -> None:
        """words: a text that says how to continue a paused simulation; empty while the simulation runs."""
        if words != self._paused:
            self._paused = words
            self._say()

    def _say(self) -> None:
        if self._missing > 0.0:
            words = f"out of reach by {100 * self._missing:.0f} cm"
        else:
            words = self._paused or (_INVITATION if self._invites else "")
        if words == self._said:
            return
        self._said = words
        self._label.visible = bool(words)
        if words:
            self._label.text = words

    def remove(self) -> None:
        """Removes the target from the scene."""
        for node in (self._gizmo, self._accepted, self._then, self._gap):
            node.remove()

    def look_back(self, then: np.ndarray | None) -> None:
        """Shows the ball at its position in the past, without a gizmo; None: the present state."""
        back = then is not None
        if self._then.visible != back:
            self._then.visible, self._gizmo.visible = back, not back
        if then is not None:
            self._then.position = then


class TargetFrames:
    """The filtered target, which the controller follows at present, beside the actual frame."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._desired = scene.add_frame(
            "/desired", axes_length=_FRAME, axes_radius=0.0035, origin_radius=0.009, visible=False
        )
        self._shown = np.full(7, np.nan)
        self._actual = scene.add_frame("/actual", axes_length=1.25 * _FRAME, axes_radius=0.0025)

    def show(self, on: bool) -> None:
        self._desired.visible = self._actual.visible = on

    def actual(self, pose: np.ndarray) -> None:
        """pose (7,): position and quaternion wxyz."""
        moved = ~(np.abs(pose - self._shown) <= _STILL)  # NaN: never shown
        if self._actual.visible and moved.any():
            self._shown = pose.copy()
            private.shift(self._actual, pose[:3])
            private.turn(self._actual, pose[3:])

    def desired(self, position: np.ndarray, xyzw: np.ndarray | None) -> None:
        if np.isfinite(position).all():
            self._desired.position = position
        if xyzw is not None and np.isfinite(xyzw).all():
            self._desired.wxyz = xyzw[[3, 0, 1, 2]]


def _wxyz(rotation: np.ndarray) -> np.ndarray:
    return vtf.SO3.from_matrix(rotation).wxyz

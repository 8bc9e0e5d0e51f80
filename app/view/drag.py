"""The learner's hand in the scene: the gizmo, the judge of what can be reached, and what is posted of it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np
import viser
import viser.transforms as vtf

from app.client.wish import Send
from app.html.palette import RGB
from app.link.messages import Ready
from app.view.coordinates import draggable, full, raw, xyzw
from app.view.reachability import Judge, Question, Verdict
from app.view.target import Frames, TargetGizmo
from lessons.events import MoveTarget
from lessons.settings.torque import TorqueSettings

_OWN = 1.0
"""s after a drag in which targets that change are taken to be the hand's own."""


class Hand:
    """Asks the judge first wherever the hand puts the target, so that the controller gets one answer, not
    two. A scene without a draggable position target has no gizmo; then every method does nothing."""

    def __init__(
        self,
        scene: viser.SceneApi,
        ready: Ready,
        colours: dict[str, RGB],
        targets: dict[str, np.ndarray],
        tip: np.ndarray,
        size: float,
        post: Send,
        clamp: Callable[[], bool],
        dragged: Callable[[], None],
    ) -> None:
        """targets: raw targets by task, where the session has them; tip (7,): pose of the hand, position
        (m) and quaternion wxyz; size: of the gizmo, m; clamp: whether the controller gets only what can be
        reached; dragged: called at every move."""
        self.verdict: Verdict | None = None
        self._post, self._clamp, self._dragged = post, clamp, dragged
        self._targets = targets
        self._moved_at = -math.inf
        self._gizmo: TargetGizmo | None = None
        self._judge: Judge | None = None
        position, orientation = draggable(ready.tasks)
        if position is None:
            return
        self._gizmo = TargetGizmo(
            scene,
            position,
            orientation,
            colours[position.level],
            full(position, targets.get(position.name, position.raw), tip[:3]),
            np.eye(3) if orientation is None else targets.get(orientation.name, raw(orientation)),
            size,
            self._moved,
        )
        self._judge = Judge(ready.robot, self._judged)

    def _moved(self, position: np.ndarray, rotation: np.ndarray | None) -> None:
        gizmo = self._gizmo
        assert gizmo is not None and self._judge is not None
        self._dragged()
        self._moved_at = time.monotonic()
        self._judge.ask(Question(position, rotation, gizmo.position.frame))
        if rotation is not None and gizmo.orientation is not None:
            self._post(MoveTarget(gizmo.orientation.name, xyzw(rotation)))

    def _judged(self, verdict: Verdict) -> None:
        gizmo = self._gizmo
        if gizmo is None:
            return  # another stack has another target
        place = verdict.accepted if self._clamp() else verdict.question.position
        axes = ["xyz".index(axis) for axis in gizmo.position.axes]
        self._post(MoveTarget(gizmo.position.name, tuple(float(place[axis]) for axis in axes)))
        self.verdict = verdict

    def recall(self, tip: np.ndarray) -> None:
        """Brings the target to the robot's hand, whose pose is tip (7,)."""
        gizmo = self._gizmo
        if gizmo is not None:
            rotation = vtf.SO3(tip[3:]).as_matrix()
            gizmo.put(tip[:3], rotation)
            self._moved(tip[:3], rotation if gizmo.orientation is not None else None)

    def after_reset(self, targets: dict[str, np.ndarray]) -> None:
        """The session put its raw targets back: so does the gizmo."""
        gizmo = self._gizmo
        if gizmo is not None:
            turned = None if gizmo.orientation is None else targets.get(gizmo.orientation.name)
            gizmo.put(full(gizmo.position, targets.get(gizmo.position.name), gizmo.raw), turned)
        self.verdict = None

    def follow(self, targets: dict[str, np.ndarray]) -> None:
        """Where a script, not the hand, moves the session's targets, the gizmo goes along."""
        before, self._targets = self._targets, targets
        by_hand = time.monotonic() - self._moved_at < _OWN
        if not by_hand and any(not np.array_equal(before.get(name, at), at) for name, at in targets.items()):
            self.after_reset(targets)

    def show(
        self,
        frames: Frames,
        settings: TorqueSettings,
        latest: np.ndarray,
        fields: dict[str, slice],
    ) -> None:
        """The filtered target of the last telemetry row, rings while they turn something, and the verdict."""
        gizmo = self._gizmo
        if gizmo is None:
            return
        turned = None if gizmo.orientation is None else latest[fields[f"x_d/{gizmo.orientation.name}"]]
        position = latest[fields[f"x_d/{gizmo.position.name}"]]
        frames.desired(full(gizmo.position, position, gizmo.raw), turned)
        if gizmo.orientation is not None:
            name = gizmo.orientation.level
            gizmo.show_rings(any(level.name == name and level.enabled for level in settings.levels))
        if self.verdict is not None:
            gizmo.show_accepted(self.verdict.accepted, self.verdict.missing)

    def look_back(self, targets: dict[str, np.ndarray] | None) -> None:
        """Raw targets of a moment of the past, where a ball shows the one that is dragged now; None: now."""
        gizmo = self._gizmo
        if gizmo is not None:
            then = None if targets is None else targets.get(gizmo.position.name)
            gizmo.look_back(None if then is None else full(gizmo.position, then, gizmo.raw))

    def remove(self) -> None:
        """Takes the gizmo out of the scene."""
        self.close()
        if self._gizmo is not None:
            self._gizmo.remove()
            self._gizmo = None

    def close(self) -> None:
        if self._judge is not None:
            self._judge.close()

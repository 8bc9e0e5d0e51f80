"""The learner's hand in the scene: the gizmo, the judge of what can be reached, and what is posted of it."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from functools import partial

import numpy as np
import viser
import viser.transforms as vtf

from app.client.pending_edit import Send
from app.html.palette import RGB
from app.link.messages import Ready
from app.view.coordinates import draggable, full, of_task, raw, xyzw
from app.view.reachability import Question, Reachability, ReachabilityWorker
from app.view.target import TargetFrames, TargetGizmo
from lessons.events import MoveTarget
from lessons.settings.torque import TorqueSettings

_OWN = 1.0
"""s after a drag in which targets that change are taken to be the hand's own."""
_PATIENCE = 0.05
"""s that a drag waits for the judge: within reach it answers in a millisecond."""
_PAUSED, _LESSON_PAUSED = "paused: Space, or Run, goes on", "paused: P, or Run this step, goes on"
Later = Callable[[float, Callable[[], None]], object]
"""Calls something after so many seconds."""


class Hand:
    """Gives the controller position and orientation of the target together.

    Kept within reach, they wait for the judge, so that the controller gets one answer, not two; after
    `_PATIENCE` the orientation goes on with the position that the controller has already, which is as good as
    the last that was accepted, and the judge's follows when it answers. Not kept within reach, nothing waits.
    A scene without a draggable position target has no gizmo; then every method does nothing.
    """

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
        later: Later,
    ) -> None:
        """targets: raw targets by task, where the session has them; tip (7,): pose of the hand, position
        (m) and quaternion wxyz; size: of the gizmo, m; clamp: whether the controller gets only what can be
        reached; dragged: called at every move; later: of viser's loop, on which the hand moves."""
        self.verdict: Reachability | None = None
        self._post, self._clamp, self._dragged = post, clamp, dragged
        self._targets = targets
        self._moved_at = -math.inf
        self._later = later
        self._go_on = _LESSON_PAUSED if ready.choice.exercise is not None else _PAUSED
        self._gizmo: TargetGizmo | None = None
        self._judge: ReachabilityWorker | None = None
        self._lock = threading.Lock()  # the hand moves on viser's loop, the judge answers on its own thread
        self._moves = self._given = self._turned = self._forgotten = 0
        position, orientation = draggable(ready.tasks)
        if position is None:
            return
        start = of_task(position, targets)
        turned = None if orientation is None else of_task(orientation, targets)
        if orientation is not None and turned is None:
            turned = raw(orientation)
        self._place = full(position, position.raw if start is None else start, tip[:3])
        self._gizmo = TargetGizmo(
            scene,
            position,
            orientation,
            colours[position.level],
            self._place,
            np.eye(3) if turned is None else turned,
            size,
            self._moved,
        )
        self._judge = ReachabilityWorker(ready.robot, self._placed, self._judged)

    def _moved(self, position: np.ndarray, rotation: np.ndarray | None) -> None:
        gizmo, judge = self._gizmo, self._judge
        if gizmo is None or judge is None:
            return  # a drag that arrives while the gizmo makes room for another stack's
        self._dragged()
        self._moved_at = time.monotonic()
        waits = self._clamp()
        with self._lock:
            self._moves += 1
            question = Question(position, rotation, gizmo.position.frame, self._moves)
            if not waits:
                self._give(gizmo, question, position)
        judge.ask(question)
        if waits:
            self._later(_PATIENCE, partial(self._wait_no_longer, question))

    def _give(self, gizmo: TargetGizmo, question: Question, place: np.ndarray) -> None:
        """Posts a place (3,), m, and the orientation that the hand had in that moment, unless a later one is
        posted already."""
        self._given, self._place = max(self._given, question.number), place
        axes = ["xyz".index(axis) for axis in gizmo.position.axes]
        self._post(MoveTarget(gizmo.position.name, tuple(float(place[axis]) for axis in axes)))
        if question.rotation is not None and gizmo.orientation is not None and question.number > self._turned:
            self._turned = question.number
            self._post(MoveTarget(gizmo.orientation.name, xyzw(question.rotation)))

    def _wait_no_longer(self, question: Question) -> None:
        with self._lock:
            gizmo = self._gizmo
            # Where nothing is turned there is nothing to go on with.
            if gizmo is not None and question.number > self._turned and question.rotation is not None:
                before = self._given
                self._give(gizmo, question, self._place)
                self._given = before  # the judge's answer still counts

    def _placed(self, question: Question, accepted: np.ndarray) -> None:
        with self._lock:
            gizmo = self._gizmo
            if gizmo is not None and question.number > self._given:
                self._give(gizmo, question, accepted)

    def _judged(self, verdict: Reachability) -> None:
        if self._gizmo is not None and verdict.question.number > self._forgotten:
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
            turned = None if gizmo.orientation is None else of_task(gizmo.orientation, targets)
            place = of_task(gizmo.position, targets)
            place = gizmo.raw if place is None else full(gizmo.position, place, gizmo.raw)
            gizmo.put(place, turned)
            with self._lock:
                self._place = place
                self._given = self._turned = self._forgotten = self._moves
        self.verdict = None

    def follow(self, targets: dict[str, np.ndarray]) -> None:
        """Where a script, not the hand, moves the session's targets, the gizmo goes along."""
        before, self._targets = self._targets, targets
        by_hand = time.monotonic() - self._moved_at < _OWN
        if not by_hand and any(not np.array_equal(before.get(name, at), at) for name, at in targets.items()):
            self.after_reset(targets)

    def show(
        self,
        frames: TargetFrames,
        settings: TorqueSettings,
        latest: np.ndarray,
        fields: dict[str, slice],
        running: bool,
    ) -> None:
        """The filtered target of the last telemetry row, rings while they turn something, and the verdict.
        running: whether time passes, or the past is looked at."""
        gizmo = self._gizmo
        if gizmo is None:
            return
        turned = None if gizmo.orientation is None else latest[fields[f"x_d/{gizmo.orientation.name}"]]
        position = latest[fields[f"x_d/{gizmo.position.name}"]]
        frames.desired(full(gizmo.position, position, gizmo.raw), turned)
        if gizmo.orientation is not None:
            name = gizmo.orientation.level
            gizmo.show_rings(any(level.name == name and level.enabled for level in settings.levels))
        gizmo.pause("" if running else self._go_on)
        if self.verdict is not None:
            gizmo.show_accepted(self.verdict.accepted, self.verdict.missing)

    def look_back(self, targets: dict[str, np.ndarray] | None) -> None:
        """Raw targets of a moment of the past, where a ball shows the one that is dragged now; None: now."""
        gizmo = self._gizmo
        if gizmo is not None:
            then = None if targets is None else of_task(gizmo.position, targets)
            gizmo.look_back(None if then is None else full(gizmo.position, then, gizmo.raw))

    def remove(self) -> None:
        """Takes the gizmo out of the scene."""
        self.close()
        gizmo, self._gizmo = self._gizmo, None  # a drag may still be on its way
        if gizmo is not None:
            gizmo.remove()

    def close(self) -> None:
        if self._judge is not None:
            self._judge.close()

"""Dragging the target: the gizmo, the check of reachability, and the events that are posted."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from functools import partial

import numpy as np
import viser
import viser.transforms as vtf

from app.html.palette import RGB
from app.link.messages import Ready
from app.view.coordinates import draggable, full, of_task, raw, xyzw
from app.view.movable import Movable, turned
from app.view.reachability import Question, Reachability, ReachabilityWorker
from app.view.target import TargetFrames, TargetGizmo
from lessons.events import MoveTarget
from lessons.settings.torque import TorqueSettings

_OWN = 1.0
"""Time, s, after a drag during which changes of targets are attributed to this drag."""
_PATIENCE = 0.05
"""Time, s, that a drag waits for the reachability check, which takes a millisecond for reachable targets."""
_PAUSED, _LESSON_PAUSED = "paused: press Space or Run to continue", "paused: press P or Run this step"
Later = Callable[[float, Callable[[], None]], object]
"""Calls a function after a delay, s."""


class Hand:
    """Gives the controller the position and orientation of the dragged target together.

    If targets are kept within reach, both values wait for the reachability check, so that the controller gets
    them at the same time. If the check takes longer than `_PATIENCE`, the orientation is sent with the last
    accepted position, and the newly checked position follows when it is known. If targets are not kept within
    reach, nothing waits.

    If a scene has no draggable position target, there is no gizmo, and all methods do nothing.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        ready: Ready,
        colours: dict[str, RGB],
        targets: dict[str, np.ndarray],
        tip: np.ndarray,
        size: float,
        post: Callable[..., None],
        clamp: Callable[[], bool],
        dragged: Callable[[], None],
        later: Later,
    ) -> None:
        """targets: the session's raw targets by task; tip (7,): pose of the robot's hand, position (m) and
        quaternion wxyz; size: of the gizmo, m; post: posts events that take effect at the same control tick;
        clamp: returns whether the controller gets only reachable targets; dragged: called at every move;
        later: schedules a call on viser's loop, on which drags arrive."""
        self.verdict: Reachability | None = None
        self._post, self._clamp, self._dragged = post, clamp, dragged
        self._targets = targets
        self._moved_at = -math.inf
        self._later = later
        self._go_on = _LESSON_PAUSED if ready.choice.exercise is not None else _PAUSED
        self._gizmo: TargetGizmo | None = None
        self._judge: ReachabilityWorker | None = None
        self._lock = threading.Lock()  # drags arrive on viser's loop, the check answers on its own thread
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
            return  # a drag can arrive while the gizmo is replaced for another stack
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
        """Posts a position (3,), m, and the orientation at the same moment of the drag, together. The
        orientation is omitted if a later one was already posted."""
        self._given, self._place = max(self._given, question.number), place
        axes = ["xyz".index(axis) for axis in gizmo.position.axes]
        moves = [MoveTarget(gizmo.position.name, tuple(float(place[axis]) for axis in axes))]
        if question.rotation is not None and gizmo.orientation is not None and question.number > self._turned:
            self._turned = question.number
            moves.append(MoveTarget(gizmo.orientation.name, xyzw(question.rotation)))
        self._post(*moves)

    def _wait_no_longer(self, question: Question) -> None:
        with self._lock:
            gizmo = self._gizmo
            # Without an orientation there is nothing to send in the meantime.
            if gizmo is not None and question.number > self._turned and question.rotation is not None:
                before = self._given
                self._give(gizmo, question, self._place)
                self._given = before  # the result of the check will still be used

    def _placed(self, question: Question, accepted: np.ndarray) -> None:
        with self._lock:
            gizmo = self._gizmo
            if gizmo is not None and question.number > self._given:
                self._give(gizmo, question, accepted)

    def _judged(self, verdict: Reachability) -> None:
        if self._gizmo is not None and verdict.question.number > self._forgotten:
            self.verdict = verdict

    def movables(self) -> list[Movable]:
        """Returns the target, which can be moved without a mouse; [] if there is no target."""
        gizmo = self._gizmo
        if gizmo is None:
            return []
        turn = self._turn_by if gizmo.turns else None
        return [Movable(gizmo.position.name, lambda: gizmo.raw, partial(self._put, None), turn)]

    def _put(self, rotation: np.ndarray | None, position: np.ndarray) -> None:
        gizmo = self._gizmo
        if gizmo is None:
            return
        active = ["xyz".index(axis) for axis in gizmo.position.axes]
        place = gizmo.raw
        place[active] = position[active]
        gizmo.put(place, rotation)
        self._moved(place, gizmo.rotation if gizmo.turns else None)

    def _turn_by(self, by: np.ndarray) -> None:
        gizmo = self._gizmo
        if gizmo is not None:
            self._put(turned(gizmo.rotation, by), gizmo.raw)

    def recall(self, tip: np.ndarray) -> None:
        """Moves the target to the robot's hand, whose pose is tip (7,)."""
        gizmo = self._gizmo
        if gizmo is not None:
            rotation = vtf.SO3(tip[3:]).as_matrix()
            gizmo.put(tip[:3], rotation)
            self._moved(tip[:3], rotation if gizmo.orientation is not None else None)

    def after_reset(self, targets: dict[str, np.ndarray]) -> None:
        """Resets the gizmo after the session has reset its raw targets."""
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
        """Moves the gizmo along when a script, not the user, moves the session's targets."""
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
        """Shows the filtered target of the last telemetry row, rings if an orientation can be dragged, and
        the verdict.

        running: true if simulated time passes or a past instant is shown; if it is false, the gizmo says how
            to continue.
        """
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
        """Shows the dragged target as a ball at its place in the past, from the raw targets of that moment;
        None for the present."""
        gizmo = self._gizmo
        if gizmo is not None:
            then = None if targets is None else of_task(gizmo.position, targets)
            gizmo.look_back(None if then is None else full(gizmo.position, then, gizmo.raw))

    def remove(self) -> None:
        """Removes the gizmo from the scene."""
        self.close()
        gizmo, self._gizmo = self._gizmo, None  # a drag may still arrive
        if gizmo is not None:
            gizmo.remove()

    def close(self) -> None:
        if self._judge is not None:
            self._judge.close()

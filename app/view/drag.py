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

from app.adapter import private
from app.html.palette import BAD, TARGET
from app.html.text import quantity
from app.link.exercise import Lecture
from app.link.messages import Ready, TaskView
from app.view.coordinates import draggable, full, of_task, raw, xyzw
from app.view.drag_target import Gap, Handle, Movable, turned
from app.view.reachability import Question, Reachability, ReachabilityWorker
from app.view.robot import ARROW, target_radius
from lessons.events import MoveTarget
from lessons.settings.torque import TorqueSettings
from lessons.teaching.lesson import Challenge
from lessons.teaching.prediction import Choice

Moved = Callable[[np.ndarray, np.ndarray | None], None]

_FRAME = 0.09  # m
_STILL = 1e-4  # m, and the same number of rad: about a tenth of a pixel
_INVITATION = "target: pull an arrow"
_OPACITY = 0.5
_NEAR = 2e-3
"""Distance, m, below which the hand is at its target."""
_OWN = 1.0
"""Time, s, after a drag during which changes of targets are attributed to this drag."""
_PATIENCE = 0.05
"""Time, s, that a drag waits for the reachability check, which takes a millisecond for reachable targets."""
Later = Callable[[float, Callable[[], None]], object]
"""Calls a function after a delay, s."""


def paused_words(lecture: Lecture | None) -> str:
    """Returns how a paused simulation continues. lecture: the state of the lesson's step, if there is one."""
    if lecture is None or lecture.phase != "waiting":
        return "paused: press Run"
    part = lecture.exercise.part
    if isinstance(part, Challenge):
        return "paused: press Start the run"
    unanswered = isinstance(part.prediction, Choice) and lecture.answer is None
    return "paused: answer first" if unanswered else "paused: press Run this step"


class TargetGizmo:
    """The control of a target: arrows along the world's axes for a position task, rings for an orientation
    task of the same frame. The rings rotate with the target.

    The ball is at the dragged position, and a line leads to it from the hand. If this position is out of
    reach, the ball becomes transparent and red. A second ball, with a line to it, marks the position that the
    controller gets instead.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        position: TaskView,
        orientation: TaskView | None,
        start: np.ndarray,
        rotation: np.ndarray,
        size: float,
        radius: float,
        moved: Moved,
    ) -> None:
        """start (3,): initial position of the target, m; rotation (3, 3); size: of the gizmo, m; radius: of
        the ball, m; moved: called with the raw position and, if rings are shown, the raw rotation."""
        self.position, self.orientation = position, orientation
        self._rings = orientation is not None

        def dragged() -> None:
            self._invites = False
            self._say()
            moved(self.raw, self.rotation if self._rings else None)

        place = {"wxyz": _wxyz(rotation), "visible": orientation is not None}
        arrows = Handle(scene, "/target", position.axes, size, position=start)
        rings = Handle(scene, "/target/turn", position.axes, size, rings=True, **place)
        self._gizmo, self._turn = arrows.control, rings.control
        self._ball = scene.add_icosphere(
            "/target/ball", radius=radius, color=TARGET, opacity=_OPACITY, cast_shadow=False
        )
        self._ghost = scene.add_icosphere(
            "/target/ghost", radius=radius, color=BAD, opacity=0.45, visible=False, cast_shadow=False
        )
        self._label = scene.add_label("/target/label", _INVITATION, position=(0.0, 0.0, ARROW * size))
        self._said = _INVITATION
        self._invites, self._missing, self._paused = True, 0.0, ""
        self._accepted = scene.add_icosphere(
            "/accepted", radius=radius, color=TARGET, opacity=_OPACITY, visible=False, cast_shadow=False
        )
        self._then = scene.add_icosphere(
            "/target_then", radius=radius, color=TARGET, opacity=_OPACITY, visible=False, cast_shadow=False
        )
        self._gap = Gap(scene, "/gap", BAD, 0.006)
        self._way = Gap(scene, "/way", TARGET, 0.004, _NEAR)
        self._far = 0.0
        arrows.listen(dragged)
        rings.listen(dragged)

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
        self._ghost.visible = self._accepted.visible = out
        self._ball.visible = not out
        self._missing = missing
        self._gap.show(self.raw, accepted if out else self.raw)
        if out:
            self._accepted.position = accepted
        self._say()

    def pause(self, words: str) -> None:
        """words: a text that says how to continue a paused simulation; empty while the simulation runs."""
        if words != self._paused:
            self._paused = words
            self._say()

    def reach_from(self, hand: np.ndarray) -> None:
        """Draws the line from the hand (3,), m, to its target, and writes its length."""
        target = np.array(self._accepted.position, float) if self._missing > 0.0 else self.raw
        self._way.show(hand, target)
        self._far = float(np.linalg.norm(target - hand))
        self._say()

    def _say(self) -> None:
        if self._missing > 0.0:
            words = f"out of reach by {100 * self._missing:.0f} cm"
        else:
            far = f"{quantity(self._far, 'm')} to go" if self._far > _NEAR else ""
            words = self._paused or far or (_INVITATION if self._invites else "")
        if words == self._said:
            return
        self._said = words
        self._label.visible = bool(words)
        if words:
            self._label.text = words

    def remove(self) -> None:
        """Removes the target from the scene."""
        for node in (self._gizmo, self._accepted, self._then, self._gap, self._way):
            node.remove()

    def look_back(self, then: np.ndarray | None) -> None:
        """Shows the ball at its position in the past, without a gizmo; None: the present state."""
        back = then is not None
        if self._then.visible != back:
            self._then.visible, self._gizmo.visible = back, not back
        if back:
            self._way.show(self.raw, self.raw)
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
            self._place,
            np.eye(3) if turned is None else turned,
            size,
            target_radius(ready.robot),
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
        paused: str,
    ) -> None:
        """Shows the filtered target of the last telemetry row, rings if an orientation can be dragged, and
        the verdict. paused: see `TargetGizmo.pause`."""
        gizmo = self._gizmo
        if gizmo is None:
            return
        turned = None if gizmo.orientation is None else latest[fields[f"x_d/{gizmo.orientation.name}"]]
        position = latest[fields[f"x_d/{gizmo.position.name}"]]
        frames.desired(full(gizmo.position, position, gizmo.raw), turned)
        hand = full(gizmo.position, latest[fields[f"x/{gizmo.position.name}"]], gizmo.raw)
        if np.isfinite(hand).all():
            gizmo.reach_from(hand)
        if gizmo.orientation is not None:
            name = gizmo.orientation.level
            gizmo.show_rings(any(level.name == name and level.enabled for level in settings.levels))
        gizmo.pause(paused)
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

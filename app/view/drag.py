"""Dragging the target: the gizmo, the check of reachability on a thread of its own, and the events that are
posted."""

from __future__ import annotations

import math
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import scipy.optimize  # noqa: F401  `ReachJudge` needs it: loaded before the server listens, not at the first drag
import viser
import viser.transforms as vtf

from app.adapter import private
from app.html.palette import BAD, RGB, TARGET
from app.html.text import quantity
from app.link.exercise import Lecture
from app.link.threads import on_thread
from app.tab.context import PageContext
from app.view.robot import ARROW, gizmo_size, target_radius
from app.view.targets import OPACITY, Gap, Handle, HandTarget, Movable, full, of_task, raw, wxyz, xyzw
from lessons.events import MoveTarget
from lessons.teaching.lesson import Challenge
from lessons.teaching.prediction import Choice
from robots import Robot
from robots.reach import ReachJudge


@dataclass(frozen=True, eq=False)
class Question:
    """A dragged target: position (3,), m; rotation (3, 3) or None; frame: name of a link; number: number of
    the drag event."""

    position: np.ndarray
    rotation: np.ndarray | None
    frame: str
    number: int = 0


@dataclass(frozen=True, eq=False)
class Reachability:
    """accepted: the target's position, or the nearest reachable position that was found; missing: distance
    between the two positions, m; rotation_error: orientation error at the accepted position, rad (0 if no
    orientation was requested); fault: why the target could not be checked, else ""."""

    question: Question
    accepted: np.ndarray
    missing: float
    rotation_error: float
    fault: str = ""

    @property
    def reachable(self) -> bool:
        return self.missing == 0.0 and not self.fault


class ReachabilityWorker:
    """A thread that solves the inverse kinematics of dragged targets."""

    def __init__(
        self,
        robot: Robot,
        place: Callable[[Question, np.ndarray], None],
        answer: Callable[[Reachability], None],
    ) -> None:
        """place: called with the accepted position, (3,) m, as soon as it is known; answer: called with the
        complete verdict afterwards. Both are called on this worker's thread. If a check fails, only `answer`
        is called, and the next question is checked as usual."""
        self._robot = robot
        self._place, self._answer = place, answer
        self._wake = threading.Condition()
        self._question: Question | None = None
        self._closed = False
        on_thread("reachability", self._work_on_thread)

    def ask(self, question: Question) -> None:
        with self._wake:
            self._question = question
            self._wake.notify()

    def close(self) -> None:
        with self._wake:
            self._closed = True
            self._wake.notify()

    def _next(self) -> Question | None:
        with self._wake:
            self._wake.wait_for(lambda: self._closed or self._question is not None)
            question, self._question = self._question, None
            return None if self._closed else question

    def _work_on_thread(self) -> None:
        q = self._robot.home
        while (question := self._next()) is not None:
            try:
                q = self._check(question, q)
            except Exception as error:  # without an answer, no later drag would move the robot
                traceback.print_exc()
                q, fault = self._robot.home, f"{type(error).__name__}: {error}"
                self._answer(Reachability(question, question.position, 0.0, 0.0, fault))

    def _check(self, question: Question, q: np.ndarray) -> np.ndarray:
        """Answers a question; returns the posture from which the next check begins, as a dragged target moves
        little between two questions."""
        model, judge = self._robot.model, ReachJudge(self._robot)
        found = judge.solve(question.position, None, q, question.frame)
        q = found.q
        accepted, missing = question.position, 0.0
        if not found.reachable:
            data, frame = model.createData(), self._robot.frame_id(question.frame)
            pin.forwardKinematics(model, data, q)
            accepted = pin.updateFramePlacement(model, data, frame).translation.copy()
            missing = found.position_error
        self._place(question, accepted)
        turned = 0.0
        if question.rotation is not None:
            pose = judge.solve(accepted, question.rotation, q, question.frame)
            if not pose.reachable:
                turned = max(pose.rotation_error, np.radians(1.0))
            elif missing == 0.0:
                q = pose.q
        self._answer(Reachability(question, accepted, missing, turned))
        return q


_FRAME = 0.09  # m
_STILL = 1e-4  # m, and the same number of rad: about a tenth of a pixel
_INVITATION = "target: pull an arrow"
_NEAR = 2e-3
"""Distance, m, below which the hand is at its target."""
_OWN = 1.0
"""Time, s, after a drag during which changes of targets are attributed to this drag."""
_PATIENCE = 0.05
"""Time, s, that a drag waits for the reachability check, which takes a millisecond for reachable targets."""


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
        page: PageContext,
        target: HandTarget,
        start: pin.SE3,
        moved: Callable[[np.ndarray, np.ndarray | None], None],
        invites: bool,
    ) -> None:
        """start: initial pose of the target; moved: called with the raw position (3,), m, and, if rings are
        shown, the raw rotation (3, 3); invites: see `Hand`."""
        scene, size, radius = page.client.scene, gizmo_size(page.robot), target_radius(page.robot)
        self._target, axes = target, target.position.axes

        def dragged() -> None:
            self._invites = False
            self._say()
            moved(self.raw, self.rotation if self.turns else None)

        def ball(name: str, colour: RGB, opacity: float, visible: bool) -> viser.IcosphereHandle:
            return scene.add_icosphere(name, radius=radius, color=colour, opacity=opacity, visible=visible)

        turned = {"wxyz": wxyz(start.rotation), "visible": target.orientation is not None}
        arrows = self._arrows = Handle(scene, "/target", axes, size, position=start.translation)
        rings = self._rings = Handle(scene, "/target/turn", axes, size, rings=True, **turned)
        self._ball = ball("/target/ball", TARGET, OPACITY, True)
        self._ghost = ball("/target/ghost", BAD, 0.45, False)
        self._label = scene.add_label(
            "/target/label", _INVITATION, position=(0.0, 0.0, ARROW * size), anchor="bottom-center"
        )
        self._invites, self._missing, self._paused, self._far = invites, 0.0, "", 0.0
        self._accepted = ball("/accepted", TARGET, OPACITY, False)
        self._then = ball("/target_then", TARGET, OPACITY, False)
        self._gap = Gap(scene, "/gap", BAD, 0.006)
        self._way = Gap(scene, "/way", TARGET, 0.004, _NEAR)
        arrows.listen(dragged)
        rings.listen(dragged)

    @property
    def raw(self) -> np.ndarray:
        return self._arrows.position

    @property
    def rotation(self) -> np.ndarray:
        return self._rings.rotation

    @property
    def turns(self) -> bool:
        """Whether the rings are shown."""
        return self._rings.control.visible

    def show_rings(self, on: bool) -> None:
        """Shows the rings if the user may rotate the target."""
        self._rings.control.visible = on and self._target.orientation is not None

    def movable(self) -> Movable:
        """Returns the target, which can be moved without a mouse."""
        turn = self._rings.turn_by if self.turns else None
        return Movable(self._target.position.name, lambda: self.raw, self._arrows.move_to, turn)

    def put(self, position: np.ndarray, rotation: np.ndarray | None) -> None:
        """Moves the gizmo to a position and rotation, for example after a reset."""
        self._arrows.control.position = position
        if rotation is not None:
            self._rings.control.wxyz = wxyz(rotation)
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
        self._label.visible = bool(words)
        if words:
            self._label.text = words

    def remove(self) -> None:
        """Removes the target from the scene."""
        for node in (self._arrows.control, self._accepted, self._then, self._gap, self._way):
            node.remove()

    def look_back(self, then: np.ndarray | None) -> None:
        """Shows the ball at its position in the past, without a gizmo; None: the present state."""
        back = then is not None
        self._then.visible, self._arrows.control.visible = back, not back
        if then is not None:
            self._way.show(self.raw, self.raw)
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


class Hand:
    """Gives the controller the position and orientation of the dragged target together.

    If targets are kept within reach, both values wait for the reachability check, so that the controller gets
    them at the same time. If the check takes longer than `_PATIENCE`, the orientation is sent with the last
    accepted position, and the newly checked position follows when it is known. If targets are not kept within
    reach, nothing waits.
    """

    def __init__(
        self,
        page: PageContext,
        target: HandTarget,
        targets: dict[str, np.ndarray],
        clamp: viser.GuiCheckboxHandle,
        invites: bool = True,
    ) -> None:
        """targets: the session's raw targets by task; clamp: whether the controller gets only reachable
        targets; invites: whether a label invites to drag the target until it was dragged."""
        self.verdict: Reachability | None = None
        self._page, self._clamp, self._targets = page, clamp, targets
        self._position, self._orientation = position, orientation = target
        self._moved_at = -math.inf
        self._closed = False  # a drag or the result of a check can arrive while the gizmo is replaced
        self._lock = threading.Lock()  # drags arrive on viser's loop, the check answers on its own thread
        self._moves = self._given = self._turned = self._forgotten = 0
        at = of_task(position, targets)
        turned = np.eye(3) if orientation is None else of_task(orientation, targets)
        if orientation is not None and turned is None:
            turned = raw(orientation)
        hand = page.poses_or_still()[-1, :3]
        self._place = full(position, position.raw if at is None else at, hand)
        self._judge = ReachabilityWorker(page.robot, self._placed, self._judged)
        self._gizmo = TargetGizmo(page, target, pin.SE3(turned, self._place), self._moved, invites)

    def _moved(self, position: np.ndarray, rotation: np.ndarray | None) -> None:
        if self._closed:
            return
        self._page.dragged = True
        self._moved_at = time.monotonic()
        waits = bool(self._clamp.value)
        with self._lock:
            self._moves += 1
            question = Question(position, rotation, self._position.frame, self._moves)
            if not waits:
                self._give(question, position)
        self._judge.ask(question)
        if waits:
            self._page.loop.call_later(_PATIENCE, self._wait_no_longer, question)

    def _give(self, question: Question, place: np.ndarray) -> None:
        """Posts a position (3,), m, and the orientation at the same moment of the drag, together. The
        orientation is omitted if a later one was already posted."""
        self._given, self._place = max(self._given, question.number), place
        axes = ["xyz".index(axis) for axis in self._position.axes]
        moves = [MoveTarget(self._position.name, tuple(float(place[axis]) for axis in axes))]
        if question.rotation is not None and self._orientation is not None and question.number > self._turned:
            self._turned = question.number
            moves.append(MoveTarget(self._orientation.name, xyzw(question.rotation)))
        self._page.post(*moves)

    def _wait_no_longer(self, question: Question) -> None:
        with self._lock:
            # Without an orientation there is nothing to send in the meantime.
            if not self._closed and question.number > self._turned and question.rotation is not None:
                before = self._given
                self._give(question, self._place)
                self._given = before  # the result of the check will still be used

    def _placed(self, question: Question, accepted: np.ndarray) -> None:
        with self._lock:
            if not self._closed and question.number > self._given:
                self._give(question, accepted)

    def _judged(self, verdict: Reachability) -> None:
        if verdict.question.number > self._forgotten:
            self.verdict = verdict

    def movables(self) -> list[Movable]:
        return [self._gizmo.movable()]

    def recall(self, tip: np.ndarray) -> None:
        """Moves the target to the robot's hand, whose pose is tip (7,)."""
        rotation = vtf.SO3(tip[3:]).as_matrix()
        self._gizmo.put(tip[:3], rotation)
        self._moved(tip[:3], rotation if self._orientation is not None else None)

    def after_reset(self, targets: dict[str, np.ndarray]) -> None:
        """Resets the gizmo after the session has reset its raw targets."""
        turned = None if self._orientation is None else of_task(self._orientation, targets)
        place = self._full(of_task(self._position, targets))
        self._gizmo.put(place, turned)
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

    def show(self, frames: TargetFrames, latest: np.ndarray, paused: str) -> None:
        """Shows the filtered target of the last telemetry row, rings if an orientation can be dragged, and
        the verdict. paused: see `TargetGizmo.pause`."""
        gizmo, orientation, fields = self._gizmo, self._orientation, self._page.ready.layout.fields
        turned = None if orientation is None else latest[fields[f"x_d/{orientation.name}"]]
        frames.desired(self._full(latest[fields[f"x_d/{self._position.name}"]]), turned)
        hand = self._full(latest[fields[f"x/{self._position.name}"]])
        if np.isfinite(hand).all():
            gizmo.reach_from(hand)
        if orientation is not None:
            levels = self._page.settings.levels
            gizmo.show_rings(any(each.name == orientation.level and each.enabled for each in levels))
        gizmo.pause(paused)
        if self.verdict is not None:
            gizmo.show_accepted(self.verdict.accepted, self.verdict.missing)

    def look_back(self, targets: dict[str, np.ndarray] | None) -> None:
        """Shows the dragged target as a ball at its place in the past, from the raw targets of that moment;
        None for the present."""
        then = None if targets is None else of_task(self._position, targets)
        self._gizmo.look_back(None if then is None else self._full(then))

    def _full(self, values: np.ndarray | None) -> np.ndarray:
        """Returns the point with these values of the controlled coordinates, (3,) m."""
        return full(self._position, values, self._gizmo.raw)

    def remove(self) -> None:
        """Removes the gizmo from the scene."""
        self.close()
        self._gizmo.remove()

    def close(self) -> None:
        self._closed = True
        self._judge.close()

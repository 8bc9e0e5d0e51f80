"""Checks on a thread of its own whether dragged targets can be reached; only the latest question is
answered."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import scipy.optimize  # noqa: F401  `ReachJudge` needs it: loaded before the server listens, not at the first drag

from app.link.threads import on_thread
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

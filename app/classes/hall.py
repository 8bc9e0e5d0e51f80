"""A running class: its step, its votes and its members."""

from __future__ import annotations

import secrets
import time
from dataclasses import replace
from typing import Any

import numpy as np

from app.classes.room import Learners, Room, begin
from app.classes.saved import SavedGathering, restored
from app.classes.views import View, course, for_all, for_teacher
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from lessons.replay.state import decode
from robots import InputError, Robot
from robots.covering.cover_of import cover_of

Shape = dict[str, Any]


def shape_of(robot: Robot) -> Shape:
    """Returns the capsules of a robot: for each its joint (0 for the base), both ends in the joint's axes,
    mm, and its radius, mm."""
    return {
        "name": robot.name,
        "capsules": [
            [each.joint, *(round(1e3 * x) for x in (*each.start, *each.end, each.radius))]
            for each in cover_of(robot).capsules
        ],
    }


def pose_of(t: float, poses: np.ndarray) -> Shape:
    """Returns the simulated time, s, and the poses (J, 7) of joints and tip: position, mm, and quaternion
    wxyz."""
    return {
        "t": round(t, 2),
        "joints": [
            [*(round(1e3 * float(x)) for x in each[:3]), *(round(float(x), 3) for x in each[3:])]
            for each in poses
        ],
    }


_LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"  # characters that cannot be confused with each other
_CODE = 6


class Hall(Room):
    """The class and its teacher's robot."""

    def __init__(
        self, sessions: Learners | None, robot: SimulationClient, named: bool = True, code: str | None = None
    ) -> None:
        """sessions: the learners with robots of their own; None if all watch the teacher's robot. robot: the
        teacher's robot. named: whether people are asked for names. code: the phones' code of a class that
        continues."""
        self.robot = robot
        self.code = code or "".join(secrets.choice(_LETTERS) for _ in range(_CODE))
        """A part of the phones' address. It gives the right to vote and to watch."""
        super().__init__(sessions, named, "" if sessions is not None else f"v/{self.code}")
        start = robot.choice.exercise
        self.course = course(None if start is None else start.lesson)
        """The lessons of the teacher's list."""
        self._runs = 0  # number of runs of the teacher's robot before the present one
        self._shape: tuple[object, Shape | None] = (None, None)

    @property
    def guide(self) -> SimulationClient:
        return self.robot

    def resume(self, kept: SavedGathering) -> None:
        """Continues a class that was saved. The teacher's robot loads its step."""
        with self._lock:
            self._state = restored(kept, frozenset(each["name"] for each in self.course))
            self._keep()
            place = self._state.place
        if place is not None:
            self.robot.load(self.robot.choice.at(place))

    # ---------------------------------------------------------------- the teacher

    def go(self, place: LessonPlace) -> None:
        """Brings every learner and the teacher's robot to a step."""
        with self._lock:
            self._state = self._state.going_to(place)
            self._lead()
            self._led[self.robot.token] = self.robot.lecture, time.monotonic()
        self.robot.load(self.robot.choice.at(place))

    def place(self, lesson: str, place: int) -> LessonPlace:
        """Returns a step of the course, or of the lesson with which the class was started. Raises InputError
        for any other step."""
        if lesson not in (each["name"] for each in self.course):
            raise InputError("there is no such lesson in this class")
        return LessonPlace.at(lesson, place + 1)

    def show_step(self) -> None:
        """Brings the teacher's robot back to the step of the class. Raises InputError if no step is
        chosen."""
        place = self.state.place
        if place is None:
            raise InputError("choose a step first")
        self.robot.load(self.robot.choice.at(place))

    def open_vote(self) -> None:
        """Opens the first or the second vote. Raises InputError if there is nothing to vote on."""
        with self._lock:
            self._state = self._state.opened()

    def close_vote(self) -> None:
        """Closes the vote. Raises InputError if no vote is open."""
        with self._lock:
            self._state = self._state.closed()

    def run(self) -> None:
        """Runs the step on the teacher's robot. If `everywhere` is set, also runs it on the robots of all
        learners who are at this step and have not run it. Raises InputError if no step is chosen."""
        with self._lock:
            self._state = self._state.started()
            state = self._state
            lecture = self._lecture_of(self.robot)
            self._runs = 0 if lecture is None else lecture.attempt
        begin(self.robot, lecture, state)
        self._let_run()

    def set(self, stays: bool, everywhere: bool) -> None:
        """Changes the settings. stays: learners stay with the class; everywhere: steps run on all pages."""
        with self._lock:
            self._state = replace(self._state, stays=stays, everywhere=everywhere)
            self._keep()

    def who(self, number: int) -> str:
        """Returns the identity of the member with this number. Raises InputError if the member has no robot
        or has left."""
        found = ((one, each) for one, each in self.state.members.items() if each.number == number)
        who, member = next(found, ("", None))
        if member is None or member.kind != "robot" or not member.here:
            raise InputError("this learner has left, and has no robot any more")
        return who

    def code_of(self, who: str) -> str:
        """Returns the state code of a learner. Raises InputError if there is no code."""
        code = next((each.code for each in self._learners() if each.token == who), "")
        if not code:
            raise InputError(
                "this learner's state has no code: the robot was uploaded, or does not answer yet"
            )
        return code

    def show_state(self, code: str) -> None:
        """Loads a learner's state into the teacher's robot. Raises InputError if the code is not valid."""
        self.robot.load(SceneChoice.of_state(decode(code)))

    # ---------------------------------------------------------------- the members

    def knows(self, seat: str) -> bool:
        """Returns whether a phone has had this seat before."""
        known = self.state.members.get(seat)
        return known is not None and known.kind == "phone"

    def enter(self, seat: str) -> str:
        """Admits a phone. Returns its seat: the seat that it had, otherwise a new one. Raises InputError if
        the class is full."""
        with self._lock:
            seat = seat if self.knows(seat) else secrets.token_urlsafe(12)
            self._state = self._state.entered(seat, "phone", time.monotonic())
        return seat

    def leave(self, who: str) -> None:
        """Called when a phone's page was closed."""
        with self._lock:
            self._state = self._state.left(who)

    def vote(self, who: str, answer: object) -> None:
        """Counts a vote. Raises InputError if it cannot be counted."""
        with self._lock:
            self._state = self._state.voted(who, answer, time.monotonic())

    def mine(self, who: str) -> float | None:
        """Returns the vote of a member in the present round."""
        poll = self.state.poll
        return None if poll is None else poll.latest.get(who)

    # ---------------------------------------------------------------- looking

    def everybody(self) -> View:
        """Returns the data that all pages show."""
        return {**for_all(self.state), "robot": self._shape[1]}

    def teachers(self) -> View:
        """Returns the further data that only the teacher's page shows."""
        with self._lock:
            lecture = self._lecture_of(self.robot)
            over = lecture is not None and lecture.exercise == self._state.place and lecture.phase == "done"
            held = lecture.holds if lecture is not None and over else ()
            return {
                **for_teacher(self._state, time.monotonic()),
                "shown": [sum(each is True for each in held), len(held)],
                "busy": self.robot.trouble() is not None,
            }

    def pose(self) -> View | None:
        """Returns the pose of the teacher's robot at this instant; None while there is no robot."""
        ready = self.robot.ready
        moment = self.robot.read(lambda block, _: block.moment())
        if ready is None or moment is None or not np.isfinite(moment[1]).all():
            return None
        return pose_of(*moment)

    def _look(self) -> None:
        ready = self.robot.ready
        if ready is not None and ready is not self._shape[0]:
            self._shape = ready, shape_of(ready.robot)
        super()._look()
        with self._lock:
            self._measure()

    def _measure(self) -> None:
        lecture = self._lecture_of(self.robot)
        over = lecture is not None and lecture.exercise == self._state.place and lecture.phase == "done"
        if self._state.running and lecture is not None and over and lecture.attempt > self._runs:
            self._state = self._state.measured(lecture.truth)

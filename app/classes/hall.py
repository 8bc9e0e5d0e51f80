"""A running class: it leads the learners' robots through the teacher's steps and collects the votes."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from app.classes.gathering import Gathering
from app.classes.picture import Shape, pose_of, shape_of
from app.classes.seats import Seats
from app.classes.views import View, course, for_all, for_teacher
from app.client.simulation_client import SimulationClient
from app.link.exercise import Lecture, LessonPlace, Predict
from robots import InputError

RATE = 5.0
"""Pictures and looks at the learners, Hz."""
_LETTERS = "abcdefghjkmnpqrstuvwxyz23456789"  # that are not taken for one another
_CODE = 6
_LOADING = 30.0  # s after which a step that was not loaded is loaded again


class Learners(Protocol):
    """The sessions of a server: the learners with robots of their own."""

    @property
    def learners(self) -> Sequence[SimulationClient]: ...


class Hall:
    """Follows the class on a thread of its own, `RATE` times a second. What people send may arrive on any
    thread."""

    def __init__(self, sessions: Learners | None, robot: SimulationClient, named: bool = True) -> None:
        """sessions: the learners with robots of their own; None if all watch the teacher's. robot: the
        teacher's. named: whether people are asked for names."""
        self.robot = robot
        self.code = "".join(secrets.choice(_LETTERS) for _ in range(_CODE))
        """Gives the right to vote and to watch, as a part of the phones' address."""
        start = robot.choice.exercise
        self.course = course(None if start is None else start.lesson)
        """The lessons of the teacher's list."""
        self._sessions = sessions
        self._state = Gathering(named)
        self._lock = threading.RLock()
        self._led: dict[str, tuple[Lecture | None, float]] = {}
        """By learner: the run that was reported before the class brought them to its step, None if they were
        there already, and when."""
        self._runs = 0  # of the teacher's robot before the present run
        self._shape: tuple[object, Shape | None] = (None, None)
        self.seats = Seats("" if sessions is not None else f"v/{self.code}")
        self._hear: Callable[[], object] = _nothing
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._follow, daemon=True, name="class")

    def start(self, hear: Callable[[], object]) -> None:
        """Begins to follow the class. hear: called after every look."""
        self._hear = hear
        self._thread.start()

    def close(self) -> None:
        """Ends the thread. The robots end with their sessions."""
        self._closed.set()
        if self._thread.ident is not None:
            self._thread.join()

    @property
    def state(self) -> Gathering:
        """The class now."""
        with self._lock:
            return self._state

    # ---------------------------------------------------------------- the teacher

    def go(self, place: LessonPlace) -> None:
        """Brings every learner and the teacher's robot to a step."""
        with self._lock:
            self._state = self._state.going_to(place)
            self._led = {self.robot.token: (self.robot.lecture, time.monotonic())}
            self._keep()
        self.robot.load(self.robot.choice.at(place))

    def place(self, lesson: str, place: int) -> LessonPlace:
        """A step of the course, or of the lesson that the class was started with. Raises InputError for any
        other one."""
        if lesson not in (each["name"] for each in self.course):
            raise InputError("there is no such lesson in this class")
        return LessonPlace.at(lesson, place + 1)

    def show_step(self) -> None:
        """Brings the teacher's robot back to the step of the class. Raises InputError without a step."""
        place = self.state.place
        if place is None:
            raise InputError("choose a step first")
        self.robot.load(self.robot.choice.at(place))

    def open_vote(self) -> None:
        """Opens the first or the second vote. Raises InputError if there is nothing to vote on."""
        with self._lock:
            self._state = self._state.opened()

    def close_vote(self) -> None:
        """Closes the vote. Raises InputError if none is open."""
        with self._lock:
            self._state = self._state.closed()

    def run(self) -> None:
        """Runs the step: on the teacher's robot, and, if set so, on those of all learners who are at it and
        have not run it. Raises InputError without a step."""
        with self._lock:
            self._state = self._state.started()
            state = self._state
            lecture = self._lecture_of(self.robot)
            self._runs = 0 if lecture is None else lecture.attempt
        begin(self.robot, lecture, state)
        for learner in self._learners() if state.everywhere else ():
            lecture = self._lecture_of(learner)
            if lecture is not None and lecture.exercise == state.place and lecture.attempt == 0:
                begin(learner, lecture, state)

    def set(self, stays: bool, everywhere: bool) -> None:
        """stays: learners stay with the class; everywhere: steps run on all pages."""
        with self._lock:
            self._state = replace(self._state, stays=stays, everywhere=everywhere)
            self._keep()

    def learner(self, number: int) -> SimulationClient:
        """The robot of the member with this number. Raises InputError if they have none, or have left."""
        with self._lock:
            who = next((one for one, each in self._state.members.items() if each.number == number), None)
        found = next((each for each in self._learners() if each.token == who), None)
        if found is None:
            raise InputError("this learner has left, and the robot with them")
        return found

    # ---------------------------------------------------------------- the members

    def enter(self, seat: str) -> str:
        """Lets a phone in; returns its seat, a new one unless it had one. Raises InputError if the class is
        full."""
        with self._lock:
            known = self._state.members.get(seat)
            seat = seat if known is not None and known.kind == "phone" else secrets.token_urlsafe(12)
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

    def call(self, who: str, name: str) -> None:
        """Stores the name that a member typed."""
        with self._lock:
            self._state = self._state.called(who, name)

    def recognise(self, who: str, before: Sequence[str], account: str = "") -> None:
        """Gives a learner who comes back with another robot their votes and progress. before: the identities
        that their browser had; account: with which they signed in."""
        with self._lock:
            self._state = self._state.succeeded(who, before, account)

    def name_of(self, who: str) -> str:
        """The name that a member typed; "" if there is none."""
        member = self.state.members.get(who)
        return "" if member is None else member.name

    def fetch(self, who: str) -> None:
        """Brings one learner to the step of the class again, on their wish."""
        with self._lock:
            self._led.pop(who, None)

    def mine(self, who: str) -> float | None:
        """The vote of a member in the present round."""
        poll = self.state.poll
        return None if poll is None else poll.latest.get(who)

    # ---------------------------------------------------------------- looking

    def everybody(self) -> View:
        """What all pages show."""
        return {**for_all(self.state), "robot": self._shape[1]}

    def teachers(self) -> View:
        """What the teacher's page shows in addition."""
        lecture = self._lecture_of(self.robot)
        over = lecture is not None and lecture.exercise == self._state.place and lecture.phase == "done"
        held = lecture.holds if lecture is not None and over else ()
        return {
            **for_teacher(self.state, time.monotonic()),
            "shown": [sum(each is True for each in held), len(held)],
            "busy": self.robot.trouble() is not None,
        }

    def pose(self) -> View | None:
        """The teacher's robot at this instant; None while there is none."""
        ready = self.robot.ready
        moment = self.robot.read(lambda block, _: block.moment())
        if ready is None or moment is None or not np.isfinite(moment[1]).all():
            return None
        return pose_of(*moment)

    def _follow(self) -> None:
        due = time.monotonic()
        while not self._closed.wait(max(0.02, due - time.monotonic())):
            due = max(due, time.monotonic() - 1 / RATE) + 1 / RATE
            self._look()
            self._hear()

    def _look(self) -> None:
        ready = self.robot.ready
        if ready is not None and ready is not self._shape[0]:
            self._shape = ready, shape_of(ready.robot)
        learners, now = self._learners(), time.monotonic()
        for learner in learners:
            self._look_at(learner, now)
        with self._lock:
            tokens = {each.token for each in learners if each.attached}
            for who, member in self._state.members.items():
                if member.kind == "robot" and member.here and who not in tokens:
                    self._state = self._state.left(who)
            self._measure()
        self.seats.show(self.state)

    def _look_at(self, learner: SimulationClient, now: float) -> None:
        with self._lock:
            if not learner.attached:
                return
            try:
                self._state = self._state.entered(learner.token, "robot", now, learner.account)
            except InputError:
                return
            lecture, here = self._lecture_of(learner), learner.choice.exercise
            self._state = self._state.seen(learner.token, here, lecture, now)
            place, stays = self._state.place, self._state.stays
            if place is None:
                return
            led = self._led.get(learner.token)
            away = stays and here != place and learner.ready is not None
            if led is not None and not (away and now - led[1] > _LOADING):
                return
            moves = here != place or (lecture is not None and lecture.attempt > 0)
            self._led[learner.token] = (learner.lecture if moves else None, now)
            learner.kept_at = place if stays else None
        if moves:
            learner.load_for_class(learner.choice.at(place))

    def _measure(self) -> None:
        lecture = self._lecture_of(self.robot)
        over = lecture is not None and lecture.exercise == self._state.place and lecture.phase == "done"
        if self._state.running and lecture is not None and over and lecture.attempt > self._runs:
            self._state = self._state.measured(lecture.truth)

    def _lecture_of(self, learner: SimulationClient) -> Lecture | None:
        """The run of a learner's step; None while the step that the class chose is being loaded."""
        led = self._led.get(learner.token)
        lecture = learner.lecture
        return None if led is not None and lecture is led[0] else lecture

    def _keep(self) -> None:
        for learner in self._learners():
            learner.kept_at = self._state.place if self._state.stays else None

    def _learners(self) -> Sequence[SimulationClient]:
        return () if self._sessions is None else self._sessions.learners


def begin(learner: SimulationClient, lecture: Lecture | None, state: Gathering) -> None:
    """Runs the step, with the class's prediction if the learner made none."""
    guess = state.guess()
    if guess is not None and (lecture is None or lecture.answer is None):
        learner.send(Predict(guess))
    learner.run_with_class()


def _nothing() -> None:
    """Used until somebody wants to hear."""

"""A running class: its step, its votes and its members, and the learners with robots of their own, who follow
it: their pages and the order of their robots."""

from __future__ import annotations

import os
import secrets
import threading
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from app.classes.gathering import Gathering
from app.classes.saved import SavedGathering, restored
from app.classes.views import View, course, for_all, for_teacher
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.exercise import Lecture, LessonPlace, Predict
from app.link.threads import on_thread
from lessons.replay.state import decode
from robots import InputError, Robot
from robots.covering.cover_of import cover_of


class Seats:
    """Stores, for each learner's page, the function that shows a view and the view that is shown now."""

    def __init__(self, vote: str) -> None:
        """vote: the page on which watchers vote; "" if learners have robots of their own."""
        self._vote = vote
        self._lock = threading.Lock()
        self._seats: dict[str, tuple[Callable[[View], object], View | None]] = {}

    def sit(self, who: str, show: Callable[[View], object]) -> None:
        """Shows the class on a learner's page from now on. show: called with the view whenever the view
        changes."""
        with self._lock:
            self._seats[who] = show, None

    def rise(self, who: str) -> None:
        with self._lock:
            self._seats.pop(who, None)

    def show(self, state: Gathering, before: Mapping[str, int]) -> None:
        """Updates all pages whose view has changed. before: for each learner who waits for a robot at the
        class's step, the number of learners before them."""
        with self._lock:
            seats = list(self._seats.items())
        everybody = for_all(state)
        for who, (show, shown) in seats:
            member = state.members.get(who)
            away = member is not None and state.place not in (None, member.at) and who not in before
            more = {"vote": self._vote, "before": before.get(who)}
            view = {**everybody, "voted": 0, "away": away, **more}
            if view == shown:
                continue
            try:
                show(view)
            except Exception:
                continue  # the page is being rebuilt, or was closed
            with self._lock:
                if who in self._seats and self._seats[who][0] is show:
                    self._seats[who] = show, view


PATIENCE = 10.0
"""Time, s, after which the next robot no longer waits for a robot that is not ready."""


class BuildQueue:
    """The learners who wait for a robot at the class's step, and those whose robot is being built."""

    def __init__(self, at_once: int) -> None:
        """at_once: the number of robots that are built at the same time."""
        self._at_once = at_once
        self._waiting: list[str] = []
        self._building: dict[str, float] = {}  # time at which the building began, s

    def clear(self) -> None:
        """Removes all learners who wait. Learners whose robots are being built for an earlier step of the
        class remain in the queue, at its start."""
        self._waiting, self._building = list(self._building), {}

    def enter(self, who: str) -> None:
        self._building.pop(who, None)
        self._waiting.append(who)

    def leave(self, who: str) -> None:
        self._building.pop(who, None)
        if who in self._waiting:
            self._waiting.remove(who)

    def has(self, who: str) -> bool:
        """Returns whether a learner waits for a robot to be built or to become ready."""
        return who in self._building or who in self._waiting

    def next(self, ready: Collection[str], now: float) -> list[str]:
        """Returns the learners whose robots must be built now. ready: the learners whose robots are at the
        class's step; now: the time, s."""
        self._building = {
            who: since for who, since in self._building.items() if who not in ready and now - since < PATIENCE
        }
        room = max(0, self._at_once - len(self._building))
        chosen, self._waiting = self._waiting[:room], self._waiting[room:]
        self._building |= dict.fromkeys(chosen, now)
        return chosen

    def before(self) -> dict[str, int]:
        """Returns, for each learner in the queue, the number of learners before them; 0 while their robot is
        being built."""
        return {
            **dict.fromkeys(self._building, 0),
            **{who: len(self._building) + k for k, who in enumerate(self._waiting)},
        }


RATE = 5.0
"""Rate at which the learners are checked, Hz."""
BUILDS = 2 * (os.cpu_count() or 1)
"""Number of robots that are built at the same time when the class goes to another step; the others wait."""
_TURN = 0.05  # s between two checks of the queue
_LOADING = 30.0  # s; a step that is not loaded by then is loaded again


class Learners(Protocol):
    """The sessions of a server: the learners with robots of their own."""

    @property
    def learners(self) -> Sequence[SimulationClient]: ...


def begin(learner: SimulationClient, lecture: Lecture | None, state: Gathering) -> None:
    """Runs the step. If the learner made no prediction, the class's prediction is used."""
    guess = state.guess()
    if guess is not None and (lecture is None or lecture.answer is None):
        learner.send(Predict(guess))
    learner.run_with_class()


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


class Hall:
    """A running class and its teacher's robot: leads the learners through the class's steps. A separate
    thread checks the learners `RATE` times a second. People's messages may arrive on any thread."""

    def __init__(
        self, sessions: Learners | None, robot: SimulationClient, named: bool = True, code: str | None = None
    ) -> None:
        """sessions: the learners with robots of their own; None if all watch the teacher's robot. robot: the
        teacher's robot. named: whether people are asked for names. code: the phones' code of a class that
        continues."""
        self.robot, self._sessions = robot, sessions
        self.code = code or "".join(secrets.choice(_LETTERS) for _ in range(_CODE))
        """A part of the phones' address. It gives the right to vote and to watch."""
        self.first = robot.choice.exercise
        """The step with which the class was started, if any."""
        self.course = course(None if self.first is None else self.first.lesson)
        """The lessons of the teacher's list."""
        self._state = Gathering(named)
        self._lock = threading.RLock()
        self._led: dict[str, tuple[Lecture | None, float]] = {}
        """For each learner: the run that was reported before the learner was brought to the class's step
        (None if the learner was there already), and the time."""
        self._builds = BuildQueue(BUILDS)
        self._due: set[str] = set()
        """The learners whose robots run the step as soon as it is loaded."""
        self.seats = Seats("" if sessions is not None else f"v/{self.code}")
        self._runs = 0  # number of runs of the teacher's robot before the present one
        self._shape: tuple[object, Shape | None] = (None, None)
        self._hear: Callable[[], object] = lambda: None
        self._closed = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, hear: Callable[[], object]) -> None:
        """Begins to follow the class. hear: called after every check of the learners."""
        self._hear = hear
        self._thread = on_thread("class", self._follow_on_thread)

    def close(self) -> None:
        """Ends the thread. The robots end with their sessions."""
        self._closed.set()
        if self._thread is not None:
            self._thread.join()

    @property
    def state(self) -> Gathering:
        with self._lock:
            return self._state

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
        moment = self.robot.read(lambda recording: recording.block.moment())
        if ready is None or moment is None or not np.isfinite(moment[1]).all():
            return None
        return pose_of(*moment)

    # ---------------------------------------------------------------- the learners

    def recognise(self, who: str, before: Sequence[str], account: str = "") -> None:
        """Adds a learner to the class before the learner's page is built, so that the name that is typed
        there can be stored. A learner who comes back with another robot gets the earlier votes and progress.
        before: the earlier identities of the browser; account: the account with which the learner signed
        in."""
        with self._lock:
            self._state = self._state.succeeded(who, before, account)
            if self._sessions is None:
                return  # the robot is the teacher's
            with suppress(InputError):  # the class is full
                self._state = self._state.entered(who, "robot", time.monotonic(), account)

    def call(self, who: str, name: str) -> None:
        """Stores the name that a member typed."""
        with self._lock:
            self._state = self._state.called(who, name)

    def name_of(self, who: str) -> str:
        """Returns the name that a member typed; "" if there is none."""
        member = self.state.members.get(who)
        return "" if member is None else member.name

    def fetch(self, who: str) -> None:
        """Brings one learner to the step of the class again, as the learner requested."""
        with self._lock:
            self._led.pop(who, None)
            self._builds.leave(who)

    # ---------------------------------------------------------------- leading them

    def _lead(self) -> None:
        """Begins to bring all learners to the step of the class, a few at a time."""
        with self._lock:
            self._led, self._due = {}, set()
            self._builds.clear()
            self._keep()
            waiting, place = self._builds.before(), self._state.place
            for learner in self._learners():
                if place is not None and learner.token in waiting:
                    learner.announce(place)

    def _keep(self) -> None:
        for learner in self._learners():
            learner.kept_at = self._state.place if self._state.stays else None

    def _let_run(self) -> None:
        """Runs the step on the robots of all learners who are at this step and have not run it. Robots that
        are still being built run it afterwards."""
        with self._lock:
            learners = self._learners() if self._state.everywhere else ()
            self._due = {each.token for each in learners if each.attached}
            for learner in learners:
                self._run_if_due(learner)

    def _run_if_due(self, learner: SimulationClient) -> None:
        who, place, lecture = learner.token, self._state.place, self._lecture_of(learner)
        coming = who not in self._led or self._builds.has(who)
        if who not in self._due or coming or (lecture is None and learner.choice.exercise == place):
            return  # a step that is still being loaded runs afterwards
        self._due.discard(who)
        if lecture is not None and lecture.exercise == place and lecture.attempt == 0:
            begin(learner, lecture, self._state)

    def _follow_on_thread(self) -> None:
        due = time.monotonic()
        while not self._closed.wait(min(_TURN, max(0.02, due - time.monotonic()))):
            self._build()
            if time.monotonic() >= due:
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
            here = {each.token for each in learners if each.attached}
            for who, member in self._state.members.items():
                if member.kind == "robot" and member.here and who not in here:
                    self._state = self._state.left(who)
            before = self._builds.before()
        self._build()
        self.seats.show(self.state, before)
        with self._lock:
            self._measure()

    def _measure(self) -> None:
        lecture = self._lecture_of(self.robot)
        over = lecture is not None and lecture.exercise == self._state.place and lecture.phase == "done"
        if self._state.running and lecture is not None and over and lecture.attempt > self._runs:
            self._state = self._state.measured(lecture.truth)

    def _build(self) -> None:
        if not self._builds.before():
            return
        learners, now = self._learners(), time.monotonic()
        with self._lock:
            for who in set(self._builds.before()) - {each.token for each in learners}:
                self._builds.leave(who)
            chosen = self._builds.next({each.token for each in learners if self._arrived(each)}, now)
            place = self._state.place
            coming = [] if place is None else [each for each in learners if each.token in chosen]
            self._led |= {each.token: (each.lecture, now) for each in coming}
        for learner in coming:
            assert place is not None
            learner.load_for_class(learner.choice.at(place))

    def _look_at(self, learner: SimulationClient, now: float) -> None:
        with self._lock:
            learner.give_way()
            if not learner.attached:
                if self._builds.has(learner.token):
                    self._builds.leave(learner.token)
                    self._led.pop(learner.token, None)  # the step is loaded when the page is open again
                return
            try:
                self._state = self._state.entered(learner.token, "robot", now, learner.account)
            except InputError:
                return
            lecture, here, coming = self._lecture_of(learner), learner.choice.exercise, learner.coming
            shown = (here, lecture) if coming is None else (coming.lecture.exercise, coming.lecture)
            self._state = self._state.seen(learner.token, *shown, now)
            self._run_if_due(learner)
            place, stays = self._state.place, self._state.stays
            if place is None or self._builds.has(learner.token):
                return
            led = self._led.get(learner.token)
            away = stays and here != place and learner.ready is not None
            if led is not None and not (away and now - led[1] > _LOADING):
                return
            learner.kept_at = place if stays else None
            self._led[learner.token] = None, now
            if here != place or (lecture is not None and lecture.attempt > 0):
                self._builds.enter(learner.token)
                learner.announce(place)

    def _arrived(self, learner: SimulationClient) -> bool:
        """Returns whether a robot that was brought to the class's step has loaded it, and has not run it."""
        lecture, led = learner.lecture, self._led.get(learner.token)
        if lecture is None or led is None or lecture is led[0]:
            return False
        return (lecture.exercise, lecture.attempt) == (self._state.place, 0)

    def _lecture_of(self, learner: SimulationClient) -> Lecture | None:
        """Returns the run of a learner's step; None while the step that the class chose is being loaded."""
        if self._builds.has(learner.token):
            return None
        led = self._led.get(learner.token)
        lecture = learner.lecture
        return None if led is not None and lecture is led[0] else lecture

    def _learners(self) -> Sequence[SimulationClient]:
        return () if self._sessions is None else self._sessions.learners

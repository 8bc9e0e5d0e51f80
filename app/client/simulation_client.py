"""The simulations of one learner: a process and perhaps its ghost. They continue when the page is reloaded.
In a class, a step is shown before the robot has loaded it, and the robot is paused after its run."""

from __future__ import annotations

import math
import os
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from queue import Empty, Queue
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple, final

from app.client.simulation import DEADLINE, Simulation, Trouble
from app.link.choice import SceneChoice
from app.link.exercise import Lecture, LessonPlace, Predict, RunStep
from app.link.messages import (
    Command,
    FollowLeader,
    GetRun,
    Lead,
    Load,
    Loading,
    LoadRefused,
    Play,
    Post,
    Reached,
    Ready,
    Report,
    ResetAll,
    RunDescription,
    Script,
    SimulationFailed,
    Status,
    WaitAt,
)
from app.link.process import Process, Spares
from app.link.threads import on_thread
from robots import InputError

if TYPE_CHECKING:
    from app.link.messages import Status
    from lessons.settings.settings import SceneSettings
    from lessons.teaching import lesson

LEAD = 0.2
"""Largest simulated time, s, by which the robot may be ahead of its ghost. If the ghost is too slow, both
slow down, and the page says so. A ghost that lags would look like a ghost that tracks its target badly."""


@final
class GhostClient(Simulation):
    """The process of a ghost that follows a leader. The first `Script` report contains the start of the
    ghost. The ghost reports the time that it has reached; this time limits the leader's advance."""

    who = "The ghost"

    def __init__(
        self,
        words: str,
        own: tuple[str, ...],
        spares: Spares,
        reached: Callable[[float], None],
        lost: Callable[[GhostClient, str], None],
    ) -> None:
        """words: the ghost's name in the legend; own: assignments "PATH=VALUE" on top of the leader's
        settings; reached: called with the time that the ghost has reached, s; lost: called with a sentence
        when the ghost cannot start or has ended. Both functions are called on a thread of the process
        handle."""
        self.words, self.own = words, own
        self._reached, self._lost = reached, lost
        self._told_at: float | None = None
        super().__init__(spares)

    def hear(self, script: Script) -> None:
        """Passes a report of the leader on to the ghost."""
        if self._told_at is None:
            self._told_at = time.monotonic()
        self.send(FollowLeader(script, self.own))

    @property
    def quiet(self) -> float:
        """As `Simulation.quiet`; 0 before the ghost has received its first command."""
        return 0.0 if self._told_at is None else min(super().quiet, time.monotonic() - self._told_at)

    def _heard(self, process: Process, report: Report) -> None:
        match report:
            case Reached(t):
                self._reached(t + LEAD)
            case LoadRefused(sentence) | SimulationFailed(sentence):
                self._lost(self, sentence)
            case _:
                pass


AFTER = 5.0
"""Time, s, from the end of a run or the learner's last action until the robot is paused."""


@final
@dataclass(frozen=True)
class Coming:
    """A step that a page shows before the robot has loaded it.

    Attributes:
        lecture: the step before its run, with the prediction that the learner made meanwhile.
        held: the learner's commands at this step; they are sent to the robot when it loads the step.
        sent: whether the robot has received the command to load the step.
    """

    lecture: Lecture
    held: tuple[Predict | RunStep, ...] = ()
    sent: bool = False

    @classmethod
    def at(cls, place: LessonPlace, settings: SceneSettings | None) -> Coming | None:
        """Returns the step before any command; None if its controls cannot be built from the present
        settings. Raises InputError if there is no such step."""
        from lessons.teaching.lesson import Step

        part = place.part
        if settings is None:
            return None
        try:
            for control in part.controls if isinstance(part, Step) else part.knobs:
                settings.value_at(control.path)
        except InputError:
            return None
        return cls(Lecture(place, "waiting", attempt=0, t=0.0, duration=part.duration))

    def after(self, command: Predict | RunStep) -> Coming:
        """Returns the same step after the learner made a prediction or pressed Run."""
        held = self.held if self.sent else (*self.held, command)
        if isinstance(command, Predict):
            return replace(self, lecture=replace(self.lecture, answer=command.answer), held=held)
        return replace(self, held=held)

    def sent_to(self, place: LessonPlace | None) -> Coming | None:
        """Returns the same step after the robot received the command to load the step `place`; None if
        `place` is another step."""
        return replace(self, held=(), sent=True) if place == self.lecture.exercise else None

    def is_at(self, lecture: Lecture) -> bool:
        """Returns whether a report comes from a robot that has loaded this step."""
        return self.sent and lecture.exercise == self.lecture.exercise


@final
class Rest:
    """Whether a robot is paused. The robot continues when its learner moves or changes anything."""

    def __init__(self) -> None:
        self._since = time.monotonic()
        self._rests = False

    def stir(self) -> None:
        """Called while a run makes progress."""
        self._since = time.monotonic()

    def wakes(self, command: Command) -> bool:
        """Notes a command of the learner; returns whether the robot must continue before it gets this
        command."""
        if not isinstance(command, Post | Play):
            return False
        kept = isinstance(command, Play) and command.running  # the learner wants to see the robot move
        self._since = math.inf if kept else max(self._since, time.monotonic())
        woken, self._rests = self._rests and isinstance(command, Post), False
        return woken

    def begins(self, lecture: Lecture | None, status: Status | None) -> bool:
        """Returns whether the robot must be paused now. lecture, status: the last reports."""
        over = lecture is not None and lecture.phase == "done" and status is not None and status.running
        self._rests = self._rests or (over and time.monotonic() - self._since > AFTER)
        return self._rests and over


STAYING = "Your teacher keeps the class at this step: wait for the next one."
WAITING = "Your teacher runs this step for everybody: say what you expect, and wait."
BEHIND = 10
"""The niceness of a simulation minus that of the server. Pages are thus served first."""


@final
class SimulationClient(Simulation):
    """The simulation of one browser tab, and its ghost, if there is one."""

    who = "The simulation"

    def __init__(self, token: str, choice: SceneChoice, spares: Spares) -> None:
        self.token = token
        self.choice = self._start_choice = choice
        self.attached = False
        self.left_at = time.monotonic()
        self.account = ""
        """The name with which the learner signed in at the proxy; "" if there is none."""
        self.ghost: GhostClient | None = None
        self.shows_ghosts = True
        """Whether a step of a lesson begins with its ghost in the scene. In a class, whose robots share one
        computer, learners switch it on themselves."""
        self.lecture: Lecture | None = None
        self.kept_at: LessonPlace | None = None
        """The step at which a teacher keeps this learner; None: the learner may go anywhere."""
        self.coming: Coming | None = None  # the class's step, until the robot has loaded it
        self._behind: int | None = None  # the process with the lower priority
        self._rest = Rest()
        self._run_requests = RunRequests()
        self._requested: RequestedScene | None = None
        super().__init__(spares)
        self.send(Load(choice))

    def trouble(self) -> Trouble | None:
        """Returns the problem of the simulation or its ghost that the page should show, or None."""
        ghost = self.ghost
        return super().trouble() or (None if ghost is None else ghost.trouble())

    def load(self, choice: SceneChoice) -> None:
        """Loads another scene; uses a new process if the present one has a problem. A learner who is kept at
        a step gets a notice instead."""
        if self.kept_at is not None and choice.exercise != self.kept_at:
            self._refuse(STAYING)
            return
        self.load_for_class(choice, patience=0.0)

    def send(self, command: Command) -> None:
        if self.kept_at is not None and isinstance(command, RunStep) and self._has_not_run:
            self._refuse(WAITING)
            return
        with self._lock:
            if self.coming is not None and isinstance(command, (Predict, RunStep)):
                self.coming = self.coming.after(command)
                if not self.coming.sent:
                    return
        if self._rest.wakes(command):
            super().send(Play(True))
        super().send(command)

    def announce(self, place: LessonPlace) -> None:
        """Shows a step of the class at once, if possible, and pauses the robot until it loads the step, see
        `load_for_class`."""
        with self._lock:
            self.coming = Coming.at(place, self.settings)
            if self.status is not None and self.status.running:
                self.send(Play(False))

    def run_with_class(self) -> None:
        """Runs the step of the lesson, also if the learner is kept at this step."""
        super().send(RunStep())

    @property
    def _has_not_run(self) -> bool:
        lecture = self.lecture
        return lecture is not None and lecture.exercise == self.kept_at and lecture.attempt == 0

    def _refuse(self, sentence: str) -> None:
        with self._lock:
            self._notices.append(sentence)

    def load_for_class(self, choice: SceneChoice, patience: float = DEADLINE) -> None:
        """As `load`, also for a learner who is kept at a step. A robot that has been silent for less than
        `patience`, s, is not replaced, as the computer is busy, and a new process would make it busier."""
        choice = choice.admitting(self._start_choice)
        self._start_choice = self._start_choice.admitting(choice)
        with self._lock:
            coming = self.coming
            self._begin_anew(Load(choice), choice, patience)
            self.coming = None if coming is None else coming.sent_to(choice.exercise)
            for command in () if coming is None or self.coming is None else coming.held:
                super().send(command)

    def reset_all(self) -> None:
        """Loads the scene again from its beginning; uses a new process if the present one has a problem."""
        self._begin_anew(ResetAll(), None, 0.0)

    def _begin_anew(self, command: Load | ResetAll, choice: SceneChoice | None, patience: float) -> None:
        """Sends the command, or starts a new process if the present one has a problem or has just ended."""
        with self._lock:
            ended = self.failure is not None or not self._process.alive or self.quiet >= patience
            if ended and self.trouble() is not None:
                self.restart(choice)
                return
            self._requested = RequestedScene(choice, -1 if self.status is None else self.status.resets)
            self.send(command)

    def restart(self, choice: SceneChoice | None = None) -> None:
        """Starts a new process with another scene, or with the last one. The old process is ended, by force
        if it does not answer. This call waits for neither process."""
        with self._lock:
            if self._closed:
                return
            before, ghost = self._process, self.ghost
            mute = super().trouble() is not None
            self.failure = self._requested = self.coming = None
            self._run_requests.forget()
            self._start()
            self.send(Load((choice or self.choice).admitting(self._start_choice)))
            if ghost is not None:
                self.send(Lead(True))
        on_thread("ending", before.close, 0.0 if mute else 1.0)
        if ghost is not None and ghost.trouble() is not None:
            self._replace_ghost(ghost.words, ghost.own)

    def _enter(self, ready: Ready) -> None:
        # The choice is stored first, so that a reader of the new settings finds the matching choice.
        self.choice, self.lecture = ready.choice, None
        super()._enter(ready)

    def choice_of(self, ready: Ready) -> SceneChoice:
        """Returns the choice of a scene (compare `settings_of`). It may be a later step of the lesson
        than the loaded step."""
        with self._lock:
            return self.choice if self.ready is ready else ready.choice

    def lecture_of(self, ready: Ready) -> Lecture | None:
        """Returns the state of the lesson in a scene; None if another scene was loaded since. A page that
        will be rebuilt must not show the next lesson yet, as a button pressed there would have no effect."""
        with self._lock:
            if self.ready is not ready:
                return None
            return self.lecture if self.coming is None else self.coming.lecture

    def _heard(self, process: Process, report: Report) -> None:
        if process is not self._process:
            return
        with self._lock:
            self._requested = None if self._requested is None else self._requested.after(report)
        match report:
            case Status(lecture=Lecture() as lecture):
                self.lecture = lecture
                self._rest.stir()
                self.choice = self.choice.at(lecture.exercise)
                with self._lock:
                    if self._requested is None and self.coming is not None and self.coming.is_at(lecture):
                        self.coming = None
            case LoadRefused():
                self.coming = None
            case RunDescription():
                self._run_requests.answer(report)
            case SimulationFailed(_, died):
                with self._lock:
                    self._run_requests.forget()
                    if died and self._requested is not None and process is self._process:
                        self.restart(self._requested.choice)
            case Script():
                ghost = self.ghost
                if ghost is not None:
                    ghost.hear(report)
            case _:
                pass

    def give_way(self) -> None:
        """Gives each new process of the robot a lower priority than the server, and pauses the robot if its
        learner does nothing, see `Rest`. Returns at once."""
        if self._rest.begins(self.lecture, self.status):
            super().send(Play(False))
        pid = self.pid
        if pid is not None and pid != self._behind:
            self._behind = pid
            lower_priority(pid)

    # ---------------------------------------------------------------- questions

    def ask(self, timeout: float = 10.0) -> RunDescription | None:
        """Requests the run so far; returns None if the simulation does not answer within `timeout` seconds.
        This call blocks: do not call it on the page's loop or on viser's."""
        with self._lock:
            answer = self._run_requests.ask(self._process)
        try:
            return None if answer is None else answer.get(timeout=timeout)
        except Empty:
            return None

    # ---------------------------------------------------------------- ghost

    def start_ghost(self, ghost: lesson.Ghost) -> None:
        """Starts a ghost: a second robot in the same scene, with the present settings and the changes in
        `ghost.set`. The scene is reset, and both robots begin together. An existing ghost is replaced. If
        `ghost.set` does not fit the scene, a notice says so and there is no ghost."""
        self._replace_ghost(ghost.words, ghost.set)

    def _replace_ghost(self, words: str, own: tuple[str, ...]) -> None:
        with self._lock:
            if self._closed:
                return
            before = self.ghost
            self.ghost = GhostClient(
                words, own, self._spares, lambda until: self.send(WaitAt(until)), self._lost_ghost
            )
        if before is not None:
            on_thread("ending", before.close)
        self.send(Lead(True))

    def stop_ghost(self) -> None:
        """Ends the ghost; the robot continues alone."""
        with self._lock:
            before, self.ghost = self.ghost, None
        self.send(Lead(False))
        if before is not None:
            on_thread("ending", before.close)

    def _lost_ghost(self, ghost: GhostClient, sentence: str) -> None:
        if ghost is self.ghost:
            self._refuse(f"There is no ghost: {sentence}")
            self.stop_ghost()

    def close(self) -> None:
        super().close()
        ghost, self.ghost = self.ghost, None
        if ghost is not None:
            ghost.close()


@final
class RunRequests:
    """The questions that a process has not answered yet."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._waiting: deque[Queue[RunDescription | None]] = deque()

    def ask(self, process: Process) -> Queue[RunDescription | None] | None:
        """Requests the run so far. Returns the queue that will get the answer; None if the process has
        ended."""
        answer: Queue[RunDescription | None] = Queue()
        with self._lock:
            if not process.send(GetRun()):
                return None
            self._waiting.append(answer)
        return answer

    def answer(self, told: RunDescription) -> None:
        """Passes an answer to the oldest question."""
        with self._lock:
            if self._waiting:
                self._waiting.popleft().put(told)

    def forget(self) -> None:
        """Ends all questions without an answer; called when the process has ended."""
        with self._lock:
            while self._waiting:
                self._waiting.popleft().put(None)


class RequestedScene(NamedTuple):
    """The scene (None: the present one), and the number of resets when it was requested."""

    choice: SceneChoice | None
    resets: int

    def after(self, report: Report) -> RequestedScene | None:
        """Returns None if the report answers this request, else this request."""
        match report:
            case Status(resets=resets) if resets != self.resets:
                return None
            case Loading() | Ready() | LoadRefused():
                return None
            case _:
                return self


def lower_priority(pid: int) -> None:
    """Gives a process a lower priority than this one."""
    with suppress(OSError):  # the process has ended, or the system forbids the change
        os.setpriority(os.PRIO_PROCESS, pid, os.getpriority(os.PRIO_PROCESS, 0) + BEHIND)

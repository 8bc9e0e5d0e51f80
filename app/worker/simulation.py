"""The simulation behind one page, without process and clock, which the worker adds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from app.link.choice import SceneChoice
from app.link.messages import (
    Begin,
    Command,
    GetRun,
    InsideRequest,
    Lead,
    Load,
    LoadRefused,
    Play,
    Post,
    Predict,
    Ready,
    Report,
    ResetAll,
    RunDescription,
    RunStep,
    Script,
    Speed,
    Status,
    StepTick,
    WaitAt,
)
from app.link.poses import LinkPoses
from app.link.ring import Block
from app.worker.lecturer import Lecturer
from app.worker.report import SessionReport
from app.worker.torque import TorqueRun
from app.worker.velocity import VelocityRun
from lessons.events import Reset, Set
from lessons.replay.state import encode, state_of
from lessons.scenes.scene import Scene
from lessons.session.session import Session
from lessons.session.start import begin
from lessons.session.torque import TorqueSession
from lessons.session.velocity import VelocitySession
from lessons.settings.assignments import parse_assignment
from lessons.settings.settings import SceneSettings
from robots import InputError

__all__ = ["SessionReport", "TorqueRun", "VelocityRun", "start"]

_REPORTS: Mapping[type[Session], type[SessionReport]] = {
    TorqueSession: TorqueRun,
    VelocitySession: VelocityRun,
}


def start(scene: Scene, seed: int) -> SessionReport:
    """Starts a scene from its beginning. Raises InputError if its settings do not fit its robot."""
    session = begin(scene, seed)
    return _REPORTS[type(session)](session)


class StateCode:
    """Makes the codes of one scene. before: the settings of the scene before any assignment; None if they are
    not known."""

    def __init__(self, choice: SceneChoice, before: SceneSettings | None) -> None:
        self._choice, self.before = choice, before
        self._made: SceneSettings | None = None  # the settings of the last code

    def of(self, settings: SceneSettings) -> str:
        """Returns the code of the scene with these settings; "" if there is none, e.g. for an uploaded robot.
        Loads nothing."""
        self._made, choice = settings, self._choice
        if self.before is None or choice.urdf_text is not None:
            return ""
        exercise = choice.exercise
        lesson, step = (None, None) if exercise is None else (exercise.lesson, exercise.place + 1)
        try:
            return encode(state_of(choice.run, settings, lesson=lesson, step=step, before=self.before))
        except InputError:
            return ""

    def news(self, settings: SceneSettings) -> str | None:
        """As `of`; None if these are the settings of the last code."""
        return None if settings is self._made else self.of(settings)


class Outlet:
    """The memory of one robot under one stack.

    Attributes:
        block: the shared memory.
        poses: computes the poses that are written into the memory.
        layout: the layout of the rows.
        step_us, late: the indices of these columns; None if a row has no such column.
        told: whether the page has received the handle of this memory.
    """

    def __init__(self, session: Session, told: bool = True) -> None:
        """Raises InputError if there is not enough memory."""
        self.told = told
        self.poses, self.layout = LinkPoses(session.robot), session.layout
        self.block = Block.for_robot(session.robot, session.layout.size)
        fields = session.layout.fields
        self.step_us = fields["step_us"].start
        self.late = fields["late"].start if "late" in fields else None

    def fits(self, session: Session) -> bool:
        """Returns whether the session's rows still have this layout. Each stack has its own layout."""
        if session.layout is not self.layout and session.layout == self.layout:
            self.layout = session.layout
        return session.layout is self.layout

    def write_poses(self, session: Session) -> None:
        """Writes the true poses of the plant's links, for the 3D view."""
        poses = self.poses.at(np.asarray(session.plant.q))
        if poses is not None:
            self.block.write_poses(poses, session.t)


class Leader:
    """The events for a ghost. Before `begin` there is no ghost. Afterwards the ghost receives all events that
    took effect, in order."""

    def __init__(self) -> None:
        self.on = False
        self.until = math.inf
        self._begin: Begin | None = None
        self._told = 0
        self._t = math.nan

    def begin(self, choice: SceneChoice, session: Session) -> None:
        """Called when the session has just been reset and the ghost begins. The simulation then waits until
        the ghost has started."""
        self.on, self.until = True, 0.0
        self._begin = Begin(choice, session.settings)
        self._told = len(session.log)

    def end(self) -> None:
        """Called when the ghost no longer follows."""
        self.on, self.until = False, math.inf

    def waits(self, t: float) -> bool:
        """Returns whether a step to time t (s) would leave the ghost too far behind."""
        return t > self.until + 1e-9

    def script(self, session: Session) -> Script | None:
        """Returns the events and the time reached since the last call; None if nothing has changed."""
        if not self.on:
            return None
        begin, self._begin = self._begin, None
        events = tuple(session.log[self._told :])
        if begin is None and not events and session.t == self._t:
            return None
        self._told += len(events)
        self._t = session.t
        return Script(events, session.t, begin)


@dataclass(frozen=True, eq=False)
class Loaded:
    """A scene at its start, which has passed all checks. mine: the learner's changes; before: the settings of
    the scene before any assignment, None if they are not known; left_out: for each task of a file that is not
    offered, the reason."""

    choice: SceneChoice
    scene: Scene
    run: SessionReport
    lecturer: Lecturer | None
    mine: tuple[Post, ...]
    before: SceneSettings | None = None
    left_out: tuple[str, ...] = ()

    def looks_like(self, choice: SceneChoice, session: Session) -> bool:
        """Returns whether this is a step of the running lesson and looks the same. The page need not be
        rebuilt then."""
        then, now = choice.exercise, self.choice.exercise
        if then is None or now is None or then.lesson != now.lesson:
            return False
        return self.run.session.layout == session.layout


def loaded_from(choice: SceneChoice, scene: Scene | None, judged: bool) -> Loaded:
    """Loads a scene. scene: replaces the scene of the choice; judged: whether the claims are judged, if the
    choice is a step of a lesson. Raises InputError for a scene or robot that cannot be loaded."""
    left_out: tuple[str, ...] = ()
    before = None
    if scene is None:
        choice, scene, before, left_out = choice.fitted()
    run = start(scene, choice.run.seed)
    mine = tuple(Post(Set(*parse_assignment(each))) for each in choice.mine)
    step = choice.exercise if judged else None
    lecturer = None if step is None else Lecturer(step, run.session, choice.run.seed)
    return Loaded(choice.resolved(), scene, run, lecturer, mine, before, left_out)


@final
class SimulationRunner:
    """A session with its play state, its speed and the memory for its telemetry."""

    def __init__(self, choice: SceneChoice, scene: Scene | None = None, judged: bool = True) -> None:
        """scene: replaces the scene of the choice; judged: whether the claims are judged, if the choice is a
        step of a lesson. Raises InputError for a scene or robot that cannot be loaded."""
        self._judged = judged
        self.running, self.speed = True, 1.0
        self.resets, self.leader = 0, Leader()
        self._enter(loaded_from(choice, scene, judged))

    def _enter(self, loaded: Loaded) -> None:
        self._outlet = Outlet(loaded.run.session)
        self._begin_anew(loaded)

    def _begin_anew(self, loaded: Loaded) -> None:
        """Begins a loaded scene. The robot of a lesson stands still until the lesson's script begins."""
        self.choice, self.scene, self.left_out = loaded.choice, loaded.scene, loaded.left_out
        self._code = StateCode(loaded.choice, loaded.before)
        self.run, self.lecturer = loaded.run, loaded.lecturer
        self.running, self.speed = self.lecturer is None, 1.0
        self._fresh_start()
        self.write_poses()
        for post in loaded.mine:
            self.handle(post)
        self.session.drain()
        self._refit()

    def _fresh_start(self) -> None:
        self.ticks = self.over_budget = self.late = self._steps = 0
        self.resets += 1
        self._sent: SceneSettings | None = None
        if self.leader.on:
            self.leader.begin(self.choice, self.session)

    @property
    def session(self) -> Session:
        return self.run.session

    @property
    def block(self) -> Block:
        """The shared memory for telemetry."""
        return self._outlet.block

    def _refit(self) -> None:
        """Allocates new memory when a new stack changes the layout of the rows. `news` then returns the
        message for the page."""
        if not self._outlet.fits(self.session):
            before, self._outlet = self._outlet, Outlet(self.session, told=False)
            before.block.close()
            self.write_poses()

    def news(self) -> Ready | None:
        """Returns the message about a telemetry layout that is new since the last call, or None."""
        told, self._outlet.told = self._outlet.told, True
        return None if told else replace(self.ready(), again=True)

    # ---------------------------------------------------------------- commands

    def handle(self, command: Command) -> Report | None:
        """Executes a command; returns the answer for the page, if the command has one."""
        lecturer = self.lecturer
        if lecturer is not None and lecturer.unanswered and isinstance(command, (Play, StepTick, RunStep)):
            self.session.notices.append("Make a prediction first: this step compares it with the run.")
            return None
        match command:
            case Post(Reset()) if lecturer is not None and not lecturer.waiting:
                self._begin(own=False, fast=False)
            case Post(Reset() as event):
                self.session.post(event)
                self.resets += 1
                if not self.running:
                    self._steps = max(self._steps, 1)  # a reset must be visible while paused, too
            case Post(Set(path)) if lecturer is not None and path.partition(".")[0] == "stack":
                self.session.notices.append(
                    "The stack cannot be changed in a lesson: load its scene in the tab Robot."
                )
            case Post(event, also):
                for each in (event, *also):
                    self.session.post(each)
                    if lecturer is not None:
                        lecturer.touch(each)
            case RunStep(own, fast):
                self._begin(own, fast)
            case Play(True) if lecturer is not None and lecturer.waiting:
                self._begin(own=True, fast=False)
            case Predict(answer):
                if lecturer is not None:
                    lecturer.answer = answer
            case Play(running):
                self.running, self._steps = running, 0
                self._finish_period()
            case StepTick():
                self.running = False
                self._finish_period()
                self._steps += 1
            case Speed(factor):
                self.speed = factor
            case ResetAll():
                again = loaded_from(replace(self.choice, mine=()), self.scene, self._judged)
                self._begin_anew(replace(again, before=self._code.before, left_out=self.left_out))
            case Load(choice):
                return self._load(choice)
            case InsideRequest() as watch:
                self.run.watch = watch
            case GetRun():
                return RunDescription(
                    self.choice, self.session.settings_now, tuple(self.session.log), self.session.t
                )
            case Lead(on):
                self._lead(on)
            case WaitAt(until) if self.leader.on:
                self.leader.until = until
            case _:
                pass
        return None

    def _lead(self, on: bool) -> None:
        if not on:
            self.leader.end()
            return
        if self.session.between:
            self.tick()
        self.session.post(Reset())
        self.session.drain()
        self._refit()
        self.resets += 1
        self.write_poses()
        self.leader.begin(self.choice, self.session)

    def _begin(self, own: bool, fast: bool) -> None:
        """Begins the run of an exercise from its start."""
        if self.lecturer is None:
            return
        settings: Any = self.lecturer.settings(own)
        self.run = start(replace(self.scene, settings=settings), self.choice.run.seed)
        self._fresh_start()
        self.running = self.lecturer.begin(self.session, fast)
        self.write_poses()

    def _load(self, choice: SceneChoice) -> Report | None:
        try:
            loaded, before = loaded_from(choice, None, self._judged), self.block
            if loaded.looks_like(self.choice, self.session):
                self._begin_anew(loaded)
                return None
            self._enter(loaded)
        except InputError as error:
            return LoadRefused(str(error))
        before.close()
        return self.ready()

    def take_steps(self) -> int:
        """Returns the number of requested single ticks, and sets it to zero."""
        steps, self._steps = self._steps, 0
        return steps

    def tick(self, ticks: int = 1) -> None:
        """Runs control periods and writes their telemetry."""
        for _ in range(ticks):
            while not self.advance():
                pass

    def advance(self) -> bool:
        """Runs one step and returns whether it completed a control period. The period's telemetry is then
        written."""
        row = self.session.advance()
        if row is None:
            return False
        self._refit()
        outlet = self._outlet
        outlet.block.write(row)
        self.ticks += 1
        self.over_budget += bool(row[outlet.step_us] > 1e6 * self.session.settings.T_s)
        self.late += outlet.late is not None and bool(row[outlet.late])
        if self.lecturer is not None and self.lecturer.follow(row):
            # The run is paused if control was lost, so that the learner sees the pose at that time.
            self.running = self.session.diverged_at is None
        return True

    @property
    def pace(self) -> float:
        """The requested simulated seconds per second."""
        pace = None if self.lecturer is None else self.lecturer.pace
        return self.speed if pace is None else pace

    @property
    def busy(self) -> bool:
        """Whether a run is active or a ghost must be computed."""
        return self.running or (self.lecturer is not None and self.lecturer.busy)

    def _finish_period(self) -> None:
        # A pause begins between two control periods. Changes during the pause take effect at once, and a
        # replay of the run with the same events gives the same result.
        if not self.running and self.session.between:
            self.tick()

    def settle(self) -> None:
        """Called while paused: requested changes take effect at once, although no time passes."""
        self.session.drain()
        self._refit()
        if self.lecturer is not None and self.lecturer.idle():
            self.running = True

    def write_poses(self) -> None:
        """Writes the true poses of the plant's links, for the 3D view."""
        self._outlet.write_poses(self.session)

    # ---------------------------------------------------------------- reports

    def ready(self) -> Ready:
        session = self.session
        return Ready(
            choice=self.choice,
            block=self.block.file,
            robot=session.robot,
            layout=session.layout,
            settings=session.settings,
            tasks=self.run.tasks(),
            room=self.run.room(),
            left_out=self.left_out,
            world=self.run.world(),
        )

    def status(self, real_time_factor: float = 0.0, capped: bool = False, coded: bool = True) -> Status:
        run, session, notices = self.run, self.session, tuple(self.session.notices)
        session.notices.clear()
        settings, sent, ran = session.settings, self._sent, self.ticks > 0
        self._sent = settings
        return Status(
            t=session.t,
            ticks=self.ticks,
            running=self.running,
            speed=self.speed,
            real_time_factor=real_time_factor,
            capped=capped,
            over_budget=self.over_budget,
            late=self.late,
            resets=self.resets,
            targets=run.targets(),
            path=run.path() if ran else np.zeros((0, 3)),
            binding=run.binding() if ran else (),
            notices=notices,
            settings=None if settings is sent else settings,
            lecture=None if self.lecturer is None else self.lecturer.report(),
            code=self._code.news(settings) if coded else None,
            **run.extras(self.running, ran),
        )

    def close(self) -> None:
        """Frees the shared memory."""
        self.block.close()

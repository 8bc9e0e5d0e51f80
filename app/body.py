"""The simulation behind one page, without process and without clock: the worker drives it in real time,
tests drive it by hand."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from app.block import Block
from app.leader import Leader
from app.messages import (
    Command,
    Lead,
    Leash,
    Load,
    Play,
    Post,
    Ready,
    Refused,
    Report,
    ResetAll,
    SceneChoice,
    Speed,
    Status,
    Step,
    Tell,
    Told,
)
from app.runs import start
from lessons.events import Reset
from lessons.kinds import AnyScene, AnySession, AnySettings, find_scene, prepared
from lessons.state import settings_now
from robots import InputError


class Body:
    """A session, whether it plays and how fast, and the memory its telemetry goes to."""

    def __init__(self, choice: SceneChoice) -> None:
        """Raises InputError for a scene or robot that cannot be loaded."""
        self.running = True
        self.speed = 1.0
        self.ticks = 0
        self.over_budget = 0
        self.late = 0
        self.resets = 0
        self._steps = 0
        self._sent: AnySettings | None = None
        self.leader = Leader()
        self._enter(choice)

    def _enter(self, choice: SceneChoice) -> None:
        scene = self._load_scene(choice)
        self.run = start(scene, choice.seed)
        self.scene, self.choice = scene, choice
        robot = self.session.robot
        self._data = robot.model.createData()
        self._tip = robot.frame_id(robot.tip)
        self._poses = np.zeros((robot.n + 1, 7))
        fields = self.session.layout.fields
        self._step_us = fields["step_us"].start
        self._late = fields["late"].start if "late" in fields else None
        self.block = Block.for_robot(robot, self.session.layout.size)
        self._fresh_start()
        self.write_poses()

    def _load_scene(self, choice: SceneChoice) -> AnyScene:
        return scene_of(choice)

    def _fresh_start(self) -> None:
        self.ticks = self.over_budget = self.late = self._steps = 0
        self.resets += 1
        self._sent = None
        if self.leader.on:
            self.leader.begin(self.choice, self.session)

    @property
    def session(self) -> AnySession:
        return self.run.session

    # ---------------------------------------------------------------- commands

    def handle(self, command: Command) -> Report | None:
        """Obeys a command; the answer, if it has one, goes to the page."""
        match command:
            case Post(Reset() as event):
                self.run.post(event)
                self.resets += 1
                if not self.running:
                    self._steps = max(self._steps, 1)  # a reset must show while paused, too
            case Post(event):
                self.run.post(event)
            case Play(running):
                self.running, self._steps = running, 0
                self._finish_period()
            case Step(ticks):
                self.running = False
                self._finish_period()
                self._steps += ticks
            case Speed(factor):
                self.speed = factor
            case ResetAll():
                self.run = start(self.scene, self.choice.seed)
                self._fresh_start()
                self.running, self.speed = True, 1.0
                self.write_poses()
            case Load(choice):
                return self._load(choice)
            case Tell():
                return Told(self.choice, settings_now(self.session), tuple(self.session.log), self.session.t)
            case Lead(on):
                self._lead(on)
            case Leash(until):
                self.leader.leash = until if self.leader.on else self.leader.leash
            case _:
                pass
        return None

    def _lead(self, on: bool) -> None:
        if not on:
            self.leader.end()
            return
        if self.run.between:
            self.tick()
        self.session.post(Reset())
        self.session.drain()
        self.resets += 1
        self.write_poses()
        self.leader.begin(self.choice, self.session)

    def _load(self, choice: SceneChoice) -> Report:
        before = self.block
        try:
            self._enter(choice)
        except InputError as error:
            return Refused(str(error))
        before.close()
        self.running, self.speed = True, 1.0
        return self.ready()

    # ---------------------------------------------------------------- simulation

    def take_steps(self) -> int:
        """Single ticks that were asked for while paused, once."""
        steps, self._steps = self._steps, 0
        return steps

    def tick(self, ticks: int = 1) -> None:
        """Runs control periods and writes their telemetry."""
        for _ in range(ticks):
            while not self.advance():
                pass

    def advance(self) -> bool:
        """One step of the run; whether a control period ended with it, and its telemetry was written."""
        row = self.run.advance()
        if row is None:
            return False
        self.block.write(row)
        self.ticks += 1
        self.over_budget += bool(row[self._step_us] > 1e6 * self.session.settings.T_s)
        self.late += self._late is not None and bool(row[self._late])
        return True

    def _finish_period(self) -> None:
        # A pause stands between two control periods: what is changed meanwhile takes effect at once, and
        # where the same events strike again a recording of the run comes out the same.
        if not self.running and self.run.between:
            self.tick()

    def settle(self) -> None:
        """While paused: what was asked for takes effect at once, though no time passes."""
        self.session.drain()

    def write_poses(self) -> None:
        """The plant's true link poses, for the 3D view."""
        model, data, poses = self.session.robot.model, self._data, self._poses
        q = np.asarray(self.session.plant.q)
        if not np.isfinite(q).all():
            return
        pin.framesForwardKinematics(model, data, q)
        for joint in range(1, model.njoints):
            poses[joint - 1] = _pose(data.oMi[joint])
        poses[-1] = _pose(data.oMf[self._tip])
        self.block.write_poses(poses, self.session.t)

    # ---------------------------------------------------------------- reports

    def ready(self) -> Ready:
        session = self.session
        return Ready(
            choice=self.choice,
            block=self.block.name,
            robot=session.robot,
            layout=session.layout,
            settings=session.settings,
            tasks=self.run.tasks(),
            room=self.run.room(),
        )

    def status(self, real_time_factor: float = 0.0, capped: bool = False) -> Status:
        run, session = self.run, self.session
        notices = tuple(session.notices)
        session.notices.clear()
        settings = session.settings
        changed = settings is not self._sent
        self._sent = settings
        ran = self.ticks > 0
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
            settings=settings if changed else None,
            gauge=None if self.running else run.gauge(),
            mission=run.mission(),
        )

    def close(self) -> None:
        """Frees the memory; for use without a page, which otherwise does it."""
        self.block.close(unlink=True)


def scene_of(choice: SceneChoice) -> AnyScene:
    """The scene with the settings chosen. Raises InputError for what cannot be loaded."""
    return prepared(find_scene(choice.name, choice.urdf, choice.tip, choice.urdf_text), None, choice.set)


def _pose(placement: pin.SE3) -> np.ndarray:
    x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
    return np.array([*placement.translation, w, x, y, z])

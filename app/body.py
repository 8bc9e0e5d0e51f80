"""The simulation behind one page, without process and without clock: the worker drives it in real time,
tests drive it by hand."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from app.block import Block
from app.messages import (
    BindingRow,
    Command,
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
    TaskView,
)
from himpc.tasks import Task
from lessons.events import Reset
from lessons.scenes import load_scene
from lessons.session import Session
from lessons.settings import SceneSettings
from robots import InputError, convergence_gauge

_LISTED = 24  # binding rows sent to the page: more cannot be read in a tenth of a second


class Body:
    """A session, whether it plays and how fast, and the memory its telemetry goes to."""

    def __init__(self, choice: SceneChoice, seed: int = 0) -> None:
        """Raises InputError for a scene or robot that cannot be loaded."""
        self.running = True
        self.speed = 1.0
        self.ticks = 0
        self.over_budget = 0
        self.resets = 0
        self._seed = seed
        self._steps = 0
        self._sent: SceneSettings | None = None
        self._enter(choice)

    def _enter(self, choice: SceneChoice) -> None:
        scene = load_scene(choice.name, choice.urdf, choice.tip, choice.urdf_text)
        self.session = Session(scene, seed=self._seed)
        self.scene, self.choice = scene, choice
        robot = self.session.robot
        self._data = robot.model.createData()
        self._tip = robot.frame_id(robot.tip)
        self._poses = np.zeros((robot.n + 1, 7))
        self._step_us = self.session.layout.fields["step_us"].start
        self.block = Block.for_robot(robot, self.session.layout.size)
        self._fresh_start()
        self.write_poses()

    def _fresh_start(self) -> None:
        self.ticks = self.over_budget = self._steps = 0
        self.resets += 1
        self._sent = None

    # ---------------------------------------------------------------- commands

    def handle(self, command: Command) -> Report | None:
        """Obeys a command; the answer, if it has one, goes to the page."""
        match command:
            case Post(Reset() as event):
                self.session.post(event)
                self.resets += 1
                if not self.running:
                    self._steps = max(self._steps, 1)  # a reset must show while paused, too
            case Post(event):
                self.session.post(event)
            case Play(running):
                self.running, self._steps = running, 0
            case Step(ticks):
                self.running = False
                self._steps += ticks
            case Speed(factor):
                self.speed = factor
            case ResetAll():
                self.session = Session(self.scene, seed=self._seed)
                self._fresh_start()
                self.running, self.speed = True, 1.0
                self.write_poses()
            case Load(choice):
                return self._load(choice)
            case _:
                pass
        return None

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
        session, block = self.session, self.block
        for _ in range(ticks):
            row = session.tick()
            block.write(row)
            self.ticks += 1
            self.over_budget += bool(row[self._step_us] > 1e6 * session.settings.T_s)

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
        self.block.write_poses(poses)

    # ---------------------------------------------------------------- reports

    def ready(self) -> Ready:
        session = self.session
        return Ready(
            choice=self.choice,
            block=self.block.name,
            robot=session.robot,
            layout=session.layout,
            settings=session.settings,
            tasks=tuple(
                self._view(task, level.name) for level in session.settings.levels for task in level.tasks
            ),
        )

    def _view(self, task: Task, level: str) -> TaskView:
        target = self.session.target(task.name)
        axes = str(getattr(task, "axes", ""))
        kind = "joints" if not axes else "orientation" if task.unit == "rad" else "position"
        return TaskView(
            name=task.name,
            level=level,
            kind=kind,
            unit=task.unit,
            frame=str(getattr(task, "frame", "")) or self.session.robot.tip,
            axes=axes,
            raw=None if target is None else np.array(target.raw),
            path=self.session.reference_path(task.name),
            speed_cap=float("nan") if target is None else target.caps.speed,
        )

    def status(self, real_time_factor: float = 0.0, capped: bool = False) -> Status:
        session = self.session
        notices = tuple(session.notices)
        session.notices.clear()
        settings = session.settings
        changed = settings is not self._sent
        self._sent = settings
        targets: dict[str, np.ndarray] = {}
        for task in session.layout.tasks:
            target = session.target(task.name)
            if target is not None:
                targets[task.name] = np.array(target.raw)
        ran = self.ticks > 0
        return Status(
            t=session.t,
            ticks=self.ticks,
            running=self.running,
            speed=self.speed,
            real_time_factor=real_time_factor,
            capped=capped,
            over_budget=self.over_budget,
            resets=self.resets,
            targets=targets,
            path=np.array(session.predicted_path()) if ran else np.zeros((0, 3)),
            binding=tuple(BindingRow(*row) for row in session.binding()[:_LISTED]) if ran else (),
            notices=notices,
            settings=settings if changed else None,
            gauge=None if self.running else self._gauge(),
        )

    def _gauge(self) -> tuple[float, float] | None:
        session = self.session
        if not np.isfinite(session.plant.q).all():
            return None
        M_bar = np.array(session.settings.M_bar) * session.settings.M_bar_scale
        return convergence_gauge(session.plant.mass_matrix(), M_bar)

    def close(self) -> None:
        """Frees the memory; for use without a page, which otherwise does it."""
        self.block.close(unlink=True)


def _pose(placement: pin.SE3) -> np.ndarray:
    x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
    return np.array([*placement.translation, w, x, y, z])

"""A torque-level session as the simulation process drives it: every step is a control tick."""

from __future__ import annotations

import numpy as np

from app.link.messages import BindingRow, TaskView
from app.worker.reports.report import LISTED
from himpc.tasks import Task
from lessons.events import Event
from lessons.kinds import AnyEvent
from lessons.scenes.torque_scene import Scene
from lessons.session.torque import Session
from robots import convergence_gauge


class TorqueRun:
    """See `app.worker.reports.report.Run`."""

    def __init__(self, scene: Scene, seed: int) -> None:
        self.session = Session(scene, seed)

    @property
    def step_s(self) -> float:
        return self.session.settings.T_s

    @property
    def between(self) -> bool:
        return False

    def post(self, event: AnyEvent) -> None:
        if isinstance(event, Event):
            self.session.post(event)
        else:
            self.session.notices.append("This scene has no mission: choose one of the HTMPC scenes.")

    def advance(self) -> np.ndarray:
        return self.session.tick()

    def tasks(self) -> tuple[TaskView, ...]:
        levels = self.session.settings.levels
        return tuple(self._view(task, level.name) for level in levels for task in level.tasks)

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

    def targets(self) -> dict[str, np.ndarray]:
        found = {task.name: self.session.target(task.name) for task in self.session.layout.tasks}
        return {name: np.array(target.raw) for name, target in found.items() if target is not None}

    def path(self) -> np.ndarray:
        return np.array(self.session.predicted_path())

    def room(self) -> np.ndarray:
        return np.zeros((0, 3))

    def binding(self) -> tuple[BindingRow, ...]:
        return tuple(BindingRow(*row) for row in self.session.binding()[:LISTED])

    def gauge(self) -> tuple[float, float] | None:
        session = self.session
        if not np.isfinite(session.plant.q).all():
            return None
        M_bar = np.array(session.settings.M_bar) * session.settings.M_bar_scale
        return convergence_gauge(session.plant.mass_matrix(), M_bar)

    def mission(self) -> None:
        return None

"""What there is to see of a torque-level session."""

from __future__ import annotations

from typing import final

import numpy as np

from app.link.messages import TaskView
from app.worker.reports.report import Run
from himpc.tasks import Task
from lessons.session.torque import TorqueSession
from robots import convergence_gauge


@final
class TorqueRun(Run):
    """See `app.worker.reports.report.Run`."""

    session: TorqueSession

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

    def gauge(self) -> tuple[float, float] | None:
        session = self.session
        if not np.isfinite(session.plant.q).all():
            return None
        M_bar = np.array(session.settings.M_bar) * session.settings.M_bar_scale
        return convergence_gauge(session.plant.mass_matrix(), M_bar)

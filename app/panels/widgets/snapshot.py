"""The data that panels show: one instant of a learner's session."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from app.link.messages import Ready, Status
from lessons.settings.settings import SceneSettings

S_co = TypeVar("S_co", bound=SceneSettings, covariant=True)


@dataclass(frozen=True, eq=False)
class SessionSnapshot(Generic[S_co]):
    """latest: the last telemetry row; bound_seconds: (n, number of constraints), the time, s, that each joint
    has spent at the bound of each of himpc's `CONSTRAINTS` since the last reset."""

    ready: Ready
    settings: S_co
    status: Status
    latest: np.ndarray
    bound_seconds: np.ndarray

    def field(self, name: str) -> np.ndarray:
        """Returns a field of the last row."""
        return self.latest[self.ready.layout.fields[name]]

    def number(self, name: str) -> float:
        """Returns a scalar field of the last row; NaN if the layout has no field of this name."""
        where = self.ready.layout.fields.get(name)
        return float("nan") if where is None else float(self.latest[where][0])

    def fallback(self, level: str) -> str:
        """Returns the name of the fallback with which a level was solved at the last row; "" if none was
        needed or the level was not solved."""
        code = self.number(f"fallback/{level}")
        return self.ready.layout.fallbacks[int(code)] if code > 0 else ""

    def error(self, task: str) -> float:
        """Returns the error norm ‖x̃‖ of a task, m or rad."""
        return float(np.linalg.norm(self.field(f"error/{task}")))

"""One run as data: its session and a row of telemetry per control period."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from himpc.telemetry import Layout
from lessons.session.session import Session

Array = NDArray[np.float64]


@final
class Recording:
    """The rows of one run, one per control tick, and how long the run took in wall time."""

    def __init__(self, session: Session, rows: Sequence[Array], wall_s: float) -> None:
        # Attributes that only one kind of session has are used only by code for that kind.
        self.session: Any = session
        self.layout: Layout = session.layout
        self.rows = np.array(rows).reshape(len(rows), session.layout.size)
        self.wall_s = wall_s

    def __getitem__(self, field: str) -> Array:
        """Returns a field over time, (ticks, width)."""
        return self.rows[:, self.layout.fields[field]]

    @property
    def duration(self) -> float:
        """Simulated seconds."""
        return len(self.rows) * self.session.settings.T_s

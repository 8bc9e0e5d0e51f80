"""Rows kept for export: exact ones, but not every one."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from app.client.decimated import KEPT

if TYPE_CHECKING:
    from himpc.telemetry import Layout

RATE = 100.0
"""Rows kept per simulated second."""
MOST = 12_000
"""Rows kept of a whole run. One that is longer keeps every second, fourth, … of them."""


class Record:
    """The rows since the last reset: the last minute at RATE, and the whole run as densely as MOST allows."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._t = layout.fields["t"].start
        self._recent: deque[np.ndarray] = deque(maxlen=round(KEPT * RATE))
        self._whole: list[np.ndarray] = []
        self._every = 1
        self._kept = 0
        self._mark = -1

    def take(self, rows: np.ndarray) -> None:
        """Rows in order; a time that goes back begins a new run."""
        if self._recent and rows[0, self._t] < self._recent[-1][self._t]:
            self._recent.clear()
            self._whole.clear()
            self._every, self._kept, self._mark = 1, 0, -1
        marks = np.floor(rows[:, self._t] * RATE + 1e-6).astype(np.int64)
        for row, mark in zip(rows, marks.tolist(), strict=True):
            if mark != self._mark:
                self._mark = mark
                self._keep(row.copy())

    def _keep(self, row: np.ndarray) -> None:
        self._recent.append(row)
        if self._kept % self._every == 0:
            self._whole.append(row)
            if len(self._whole) >= MOST:
                self._whole = self._whole[::2]
                self._every *= 2
        self._kept += 1

    def recent(self) -> np.ndarray:
        """(k, size) rows of the last minute."""
        return self._stacked(list(self._recent))

    def whole(self) -> np.ndarray:
        """(k, size) rows since the last reset."""
        return self._stacked(self._whole)

    def _stacked(self, rows: list[np.ndarray]) -> np.ndarray:
        return np.array(rows) if rows else np.empty((0, self.layout.size))

"""The telemetry rows of a run that is in progress."""

from __future__ import annotations

import numpy as np

from himpc.telemetry import Layout

BUCKETS = 120


class LessonRows:
    """Telemetry rows since the run's start; `record[field]` is (ticks, width), like a finished recording."""

    def __init__(self, layout: Layout, room: int, rows: np.ndarray | None = None) -> None:
        """room: expected number of rows; rows: the rows so far."""
        self._layout = layout
        self._rows = np.empty((max(room, 1), layout.size)) if rows is None else rows
        self._count = 0 if rows is None else len(rows)

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, field: str) -> np.ndarray:
        return self._rows[: self._count, self._layout.fields[field]]

    def add(self, row: np.ndarray) -> None:
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        self._rows[self._count] = row
        self._count += 1

    def until(self, t: float) -> LessonRows:
        """Returns the rows up to a time, s."""
        count = int(np.searchsorted(self["t"][:, 0], t + 1e-9, "right"))
        return LessonRows(self._layout, count, self._rows[:count])


def thinned(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Decimates a curve to its two ends and at most 2 · BUCKETS points: the minimum and the maximum of the
    finite values in each bucket, each at its own time."""
    if len(t) <= 2 * BUCKETS:
        return t.copy(), values.copy()
    starts = np.arange(BUCKETS + 1) * (len(t) - 1) // BUCKETS + 1
    starts[0] = 0
    places = np.minimum(starts[:-1, None] + np.arange(np.diff(starts).max()), starts[1:, None] - 1)
    found = values[places]
    known = np.isfinite(found)
    low = np.where(known, found, np.inf).argmin(axis=1)
    high = np.where(known, found, -np.inf).argmax(axis=1)
    kept = np.unique(np.concatenate([[0], starts[:-1] + low, starts[:-1] + high, [len(t) - 1]]))
    return t[kept], values[kept]

"""Telemetry rows that are stored for export: exact values at a reduced rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from app.client.decimated import KEPT

if TYPE_CHECKING:
    from himpc.telemetry import Layout

RATE = 100.0
"""Number of rows that are stored per simulated second."""
MOST = 12_000
"""Largest number of rows that are stored of a whole run. Of a longer run, every second, fourth, … row is
stored."""


class RowHistory:
    """The rows since the last reset: the last minute at RATE, and the whole run as densely as MOST allows."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._t = layout.fields["t"].start
        # Two blocks are allocated once. A separate array per row would live for minutes among arrays that
        # live for an instant, and would fragment the memory. The blocks are not filled, as the system
        # provides a memory page at the first write, and most scenes are shown for less than a minute.
        self._recent = np.empty((round(KEPT * RATE), layout.size))
        self._whole = np.empty((MOST, layout.size))
        self._clear()

    def _clear(self) -> None:
        self._every = 1
        self._kept = 0  # number of rows that were stored at RATE
        self._thinned = 0  # number of rows in `_whole`
        self._mark = -1
        self._last = -np.inf

    def under(self, layout: Layout) -> RowHistory:
        """Returns the same rows in the layout of another stack; the run continues with that stack."""
        from himpc.telemetry import relaid

        new = RowHistory(layout)
        for rows, before, count in (
            (new._recent, self._recent, min(self._kept, len(self._recent))),
            (new._whole, self._whole, self._thinned),
        ):
            rows[:count] = relaid(before[:count], self.layout, layout)
        new._every, new._kept, new._thinned = self._every, self._kept, self._thinned
        new._mark, new._last = self._mark, self._last
        return new

    def take(self, rows: np.ndarray) -> None:
        """Adds rows in order of time. A time that is earlier than the last one begins a new run."""
        times = rows[:, self._t]
        if times[0] < self._last:
            self._clear()
        self._last = float(times[-1])
        marks = np.floor(times * RATE + 1e-6).astype(np.int64)
        for k in np.flatnonzero(np.diff(marks, prepend=self._mark)):
            self._keep(rows[k])
        self._mark = int(marks[-1])

    def _keep(self, row: np.ndarray) -> None:
        self._recent[self._kept % len(self._recent)] = row
        if self._kept % self._every == 0:
            self._whole[self._thinned] = row
            self._thinned += 1
            if self._thinned == MOST:
                self._thinned = (MOST + 1) // 2
                self._whole[: self._thinned] = self._whole[::2].copy()
                self._every *= 2
        self._kept += 1

    def recent(self) -> np.ndarray:
        """Returns the rows of the last minute, (k, size)."""
        end = self._kept
        return self._recent[np.arange(max(0, end - len(self._recent)), end) % len(self._recent)]

    def whole(self) -> np.ndarray:
        """Returns the rows since the last reset, (k, size)."""
        return self._whole[: self._thinned].copy()

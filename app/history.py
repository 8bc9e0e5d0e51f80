"""The last seconds of telemetry, thinned for plots so that no spike is lost."""

from __future__ import annotations

import numpy as np

from app.block import Block
from himpc.telemetry import AT_POSITION, AT_VELOCITY, Layout

BUCKETS = 160
_SLOW = 0.85  # of the velocity limit: the controller keeps a few per cent free of its own


class History:
    """Per bucket of ticks and per column: the least and the greatest value, in the order they came.

    Buckets are aligned to the tick count, so that a curve slides instead of shimmering. Each row is looked
    at once, whatever the window.
    """

    def __init__(self, block: Block, layout: Layout, ticks_per_bucket: int) -> None:
        self.layout = layout
        self.latest = np.full(layout.size, np.nan)
        self.bound_ticks = np.zeros((layout.fields["at_bound"].stop - layout.fields["at_bound"].start, 3))
        self._block = block
        self._size = max(1, ticks_per_bucket)
        self._bucket = -1
        self._count = 0
        self._pairs = np.full((BUCKETS, 2, layout.size), np.nan)
        self._bits = np.zeros((BUCKETS, len(self.bound_ticks)), np.int64)
        self._first = np.full(layout.size, np.nan)  # of the open bucket, for the order of the pair

    @property
    def count(self) -> int:
        """Rows seen or lost so far."""
        return self._count

    def pull(self) -> int:
        """Takes over what was written since the last pull; returns how many rows."""
        start, rows = self._block.since(self._count)
        if not len(rows):
            return 0
        self._count = start + len(rows)
        self.latest = rows[-1]
        bits = rows[:, self.layout.fields["at_bound"]]
        bits = np.where(np.isfinite(bits), bits, 0).astype(np.int64)
        bits = self._viable(bits, rows)
        for k in range(3):
            self.bound_ticks[:, k] += np.count_nonzero(bits & (1 << k), axis=0)
        numbers = (start + np.arange(len(rows))) // self._size
        for bucket in np.unique(numbers):
            of_bucket = numbers == bucket
            self._merge(int(bucket), rows[of_bucket])
            self._bits[-1] |= np.bitwise_or.reduce(bits[of_bucket], axis=0)
        return len(rows)

    def _viable(self, bits: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """A joint held by its velocity row far below its velocity limit is really held by its position
        limit: viability writes that one as a bound on the speed."""
        fields = self.layout.fields
        slow = np.abs(rows[:, fields["v"]]) < _SLOW * rows[:, fields["v_limit"]]
        by_position = (bits & AT_VELOCITY != 0) & slow
        return np.where(by_position, (bits & ~AT_VELOCITY) | AT_POSITION, bits)

    def _merge(self, bucket: int, rows: np.ndarray) -> None:
        if bucket != self._bucket:
            skipped = min(bucket - self._bucket, BUCKETS)
            self._pairs = np.roll(self._pairs, -skipped, axis=0)
            self._pairs[-skipped:] = np.nan
            self._bits = np.roll(self._bits, -skipped, axis=0)
            self._bits[-skipped:] = 0
            self._bucket = bucket
            self._first = rows[0]
            low, high = rows.min(axis=0), rows.max(axis=0)
        else:
            pair = self._pairs[-1]
            low = np.fmin(pair.min(axis=0), rows.min(axis=0))
            high = np.fmax(pair.max(axis=0), rows.max(axis=0))
        rising = rows[-1] >= self._first
        self._pairs[-1, 0] = np.where(rising, low, high)
        self._pairs[-1, 1] = np.where(rising, high, low)

    def columns(self, which: slice | np.ndarray) -> np.ndarray:
        """(2 · BUCKETS, k) of some columns, oldest first; NaN where nothing was recorded."""
        return self._pairs[:, :, which].reshape(2 * BUCKETS, -1)

    def at_bound(self, kind: int) -> np.ndarray:
        """(2 · BUCKETS, n) whether a joint was at its torque (0), velocity (1) or position (2) bound."""
        return np.repeat(self._bits & (1 << kind) != 0, 2, axis=0)

    def ages(self, T_s: float) -> np.ndarray:
        """(2 · BUCKETS,) seconds before now, ≤ 0."""
        return np.linspace(-1.0, 0.0, 2 * BUCKETS) * (BUCKETS * self._size * T_s)

    def clear_bounds(self) -> None:
        """Starts the time at bounds again (after a reset)."""
        self.bound_ticks[:] = 0

    def forget(self) -> None:
        """Drops the curves, for after a reset: a jump in a curve would look like a motion."""
        self._pairs[:] = np.nan
        self._bits[:] = 0
        self.clear_bounds()

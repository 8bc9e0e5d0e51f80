"""What a page keeps of a run: the last minute for plots (short peaks are kept, and points that nobody can see
are left out) and for looking back, exact rows for export, and running sums over all ticks."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from app.link.messages import Status
from app.link.ring import Block

if TYPE_CHECKING:
    from himpc.telemetry import Layout

FRAMES = 30.0
"""Number of frames that are stored per simulated second."""


@dataclass(frozen=True, eq=False)
class Frame:
    """t: s; poses: (J, 7), as in `Block`; status: the newest report at that time."""

    t: float
    poses: np.ndarray
    status: Status | None


class PoseHistory:
    """Frames in order of time, for at most one minute of simulated time. A reset deletes them."""

    def __init__(self) -> None:
        self._frames: list[Frame] = []

    def add(self, frame: Frame) -> None:
        """Adds the newest frame. If the previous frame is closer than 1/FRAMES to the frame before it, the
        newest frame replaces the previous frame. Thus slow motion needs no more memory."""
        frames = self._frames
        if frames and frame.t < frames[-1].t:
            frames.clear()
        if len(frames) > 1 and frames[-1].t - frames[-2].t < 1 / FRAMES - 1e-9:
            frames.pop()
        frames.append(frame)
        # The limit is a time, not a number of frames, as a busy machine gives fewer frames per second.
        del frames[: self._index(frame.t - KEPT)]

    def clear(self) -> None:
        self._frames.clear()

    @property
    def span(self) -> tuple[float, float]:
        """Times of the first and the last frame that can be shown, s; (0, 0) if there are none."""
        if not self._frames:
            return 0.0, 0.0
        last = self._frames[-1].t
        return max(self._frames[0].t, last - KEPT), last

    def at(self, t: float) -> Frame | None:
        """Returns the frame at time t: poses interpolated between the two nearest frames, with the report of
        the earlier frame."""
        if not self._frames:
            return None
        k = self._index(t)
        before = self._frames[max(k - 1, 0)]
        if k == 0 or k == len(self._frames):
            return before
        after = self._frames[k]
        share = (t - before.t) / (after.t - before.t)
        return Frame(t, _between(before.poses, after.poses, share), before.status)

    def between(self, start: float, end: float) -> Iterator[Frame]:
        """Returns the frames from `start` to `end`, s."""
        return iter(self._frames[self._index(start) : self._index(end)])

    def _index(self, t: float) -> int:
        return bisect_right(self._frames, t, key=lambda frame: frame.t)


def _between(before: np.ndarray, after: np.ndarray, share: float) -> np.ndarray:
    # q and −q are the same rotation. Frames are close, so linear interpolation is good enough for
    # quaternions.
    near = np.where((before[:, 3:] * after[:, 3:]).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    there = np.hstack([after[:, :3], near * after[:, 3:]])
    found = (1 - share) * before + share * there
    found[:, 3:] /= np.linalg.norm(found[:, 3:], axis=1, keepdims=True)
    return found


WINDOW = 8.0  # s of simulated time in the plots
BUCKETS = 160  # number of buckets in a window
KEPT = 60.0  # s of simulated time that the page can show again
_SPAN = WINDOW / BUCKETS
_AGES = np.linspace(-WINDOW, 0.0, 2 * BUCKETS)
_SLOTS = round((KEPT + WINDOW) / _SPAN)
_HELD = round(
    1.0 / _SPAN
)  # largest number of buckets without a row (slow controller) that are filled from the bucket before them

_LEVELS = (2, 4, 8, 16, 32)


class History:
    """Stores for each bucket of simulated time the minimum and the maximum of each column, in the order of
    their times, and the bucket's last row.

    If the controller is slower than the buckets, some buckets have no row; a row is then valid until the next
    row. Buckets are aligned to simulated time, so that curves scroll without shimmering, and two robots on
    one clock have the same buckets. Each row is read only once, whatever span of
    time the plots show. A reset sets the time back and
    clears the curves, since a jump would look like a motion.

    Attributes:
        score: the figures of the run.
        rows: exact rows, for export.
    """

    def __init__(self, block: Block, layout: Layout, rows: RowHistory | None = None) -> None:
        """rows: the exact rows so far, of a run that continues with another stack."""
        self.layout = layout
        self.score, self.rows = RunStatistics(layout), rows or RowHistory(layout)
        self.latest = np.full(layout.size, np.nan)
        from himpc.limits import CONSTRAINTS

        joints = layout.fields["at_bound"].stop - layout.fields["at_bound"].start
        self.bound_ticks = np.zeros((joints, len(CONSTRAINTS)))
        self.bucket = -1
        self._block = block
        self._t = layout.fields["t"].start
        self._before = self._count = 0
        self._numbers = np.full(_SLOTS, -1)
        # The memory is not initialised, see `RowHistory`: a slot is valid only if `_numbers` has its bucket.
        self._pairs = np.empty((_SLOTS, 2, layout.size))
        self._lasts = np.empty((_SLOTS, layout.size))
        self._bits = np.zeros((_SLOTS, len(self.bound_ticks)), np.int64)
        self._first = np.full(layout.size, np.nan)  # the open bucket's first row

    def under(self, block: Block, layout: Layout) -> History:
        """Returns the same curves in the layout of another stack; the run continues with that stack."""
        from himpc.telemetry import relaid

        def moved(rows: np.ndarray) -> np.ndarray:
            flat = rows.reshape(-1, self.layout.size)
            return relaid(flat, self.layout, layout).reshape(*rows.shape[:-1], layout.size)

        new = History(block, layout, self.rows.under(layout))
        new.latest, new._first = moved(self.latest), moved(self._first)
        known = self._numbers >= 0
        new._pairs[known], new._lasts[known] = moved(self._pairs[known]), moved(self._lasts[known])
        new.bound_ticks, new.bucket = self.bound_ticks, self.bucket
        new._numbers, new._bits = self._numbers, self._bits
        new._before = self.count
        return new

    @property
    def count(self) -> int:
        """Number of rows read or lost so far."""
        return self._before + self._count

    def pull(self) -> int:
        """Reads the rows that were written since the last call; returns their number."""
        start, rows = self._block.since(self._count)
        if not len(rows):
            return 0
        self._count = start + len(rows)
        before = np.concatenate([[self.latest[self._t]], rows[:-1, self._t]])
        turns = np.flatnonzero(rows[:, self._t] < before)
        if turns.size:
            self.forget()
        self._take(rows[turns[-1] :] if turns.size else rows)
        return len(rows)

    def _take(self, rows: np.ndarray) -> None:
        self.latest = rows[-1].copy()  # a copy, as a view would keep all rows in memory
        bits = rows[:, self.layout.fields["at_bound"]]
        bits = np.where(np.isfinite(bits), bits, 0).astype(np.int64)
        for k in range(self.bound_ticks.shape[1]):
            self.bound_ticks[:, k] += np.count_nonzero(bits & (1 << k), axis=0)
        numbers = np.floor(rows[:, self._t] / _SPAN + 1e-6).astype(np.int64)
        starts = np.flatnonzero(np.diff(numbers, prepend=numbers[0] - 1)).tolist()
        for start, end in pairwise([*starts, len(rows)]):
            bucket = int(numbers[start])
            self._hold(bucket)
            slot = self._merge(bucket, rows[start:end])
            self._bits[slot] |= np.bitwise_or.reduce(bits[start:end], axis=0)
        self.score.append_rows(rows)
        self.rows.take(rows)

    def _hold(self, until: int) -> None:
        """Fills the buckets between the newest bucket and the bucket `until` with the last values of the
        newest bucket."""
        before = self.bucket % _SLOTS
        if self.bucket < 0 or until - self.bucket > _HELD:
            return
        for bucket in range(self.bucket + 1, until):
            slot = bucket % _SLOTS
            self._numbers[slot], self._bits[slot] = bucket, self._bits[before]
            self._pairs[slot] = self._lasts[slot] = self._lasts[before]

    def _merge(self, bucket: int, rows: np.ndarray) -> int:
        slot = bucket % _SLOTS
        if self._numbers[slot] != bucket:
            self._numbers[slot] = bucket
            self._bits[slot] = 0
            self._first = rows[0].copy()
            low, high = rows.min(axis=0), rows.max(axis=0)
        else:
            pair = self._pairs[slot]
            low = np.fmin(pair.min(axis=0), rows.min(axis=0))
            high = np.fmax(pair.max(axis=0), rows.max(axis=0))
        rising = rows[-1] >= self._first
        self._pairs[slot, 0] = np.where(rising, low, high)
        self._pairs[slot, 1] = np.where(rising, high, low)
        self._lasts[slot] = rows[-1]
        self.bucket = bucket
        return slot

    def window(self, until: float | None = None) -> PlotWindow:
        """Returns the curves for the plots up to the simulated time `until` (s); None: the present time."""
        end = self.bucket if until is None else int(np.floor(until / _SPAN + 1e-6))
        return PlotWindow(self, end)

    def at(self, t: float) -> np.ndarray:
        """Returns the newest row at the simulated time t (s), as precisely as the history stores it."""
        bucket = int(np.floor(t / _SPAN - 1e-6))
        slot = bucket % _SLOTS
        return self._lasts[slot].copy() if bucket >= 0 and self._numbers[slot] == bucket else self.latest

    def forget(self) -> None:
        """Deletes all data; used after a reset."""
        self._numbers[:] = -1
        self.bucket = -1
        self.bound_ticks[:] = 0


class PlotWindow:
    """The curves of the plots at one moment: BUCKETS pairs of values, oldest first."""

    def __init__(self, history: History, end: int) -> None:
        """end: number of the newest bucket, counted from the start of the run."""
        self.layout = history.layout
        self.first = 2 * (end - BUCKETS + 1)
        """Number of the oldest value; it may be negative."""
        wanted = np.arange(end - BUCKETS + 1, end + 1)
        wanted[(wanted > history.bucket) & (wanted <= history.bucket + _HELD)] = history.bucket
        self._slots = wanted % _SLOTS
        self._known = (history._numbers[self._slots] == wanted) & (wanted >= 0)
        self._pairs, self._bits = history._pairs, history._bits

    def columns(self, which: slice) -> np.ndarray:
        """Returns the values of some columns, (2 · BUCKETS, k); NaN where nothing was recorded."""
        return self._rows[:, which]

    @cached_property
    def _rows(self) -> np.ndarray:
        # A plot reads about ten columns. Reading them together takes as long as reading two separate columns.
        rows = self._pairs[self._slots]
        rows[~self._known] = np.nan
        return rows.reshape(2 * BUCKETS, -1)

    def at_bound(self, kind: int) -> np.ndarray:
        """Returns whether each joint was at its torque (0), velocity (1) or position (2) bound, (2 · BUCKETS,
        n)."""
        hit = (self._bits[self._slots] & (1 << kind) != 0) & self._known[:, None]
        return np.repeat(hit, 2, axis=0)

    @staticmethod
    def ages() -> np.ndarray:
        """Returns the times before the end of the window, (2 · BUCKETS,) s, ≤ 0."""
        return _AGES.copy()


def decimate(curves: np.ndarray, tolerance: float, phase: int = 0) -> np.ndarray:
    """Selects the points that are needed to draw some curves within a tolerance.

    The points are equally spaced. In a block of 2, 4, … 32 points, only the two ends are kept if every curve
    is nearly straight in this block. Blocks are aligned to the points' numbers, so that a scrolling curve
    loses the same points in every picture and does not shimmer.

    Args:
        curves: (k, m), finite.
        tolerance: largest deviation from the original curve, in the curves' unit.
        phase: number of the first point.

    Returns:
        Numbers of the points to keep, ascending; the first and the last are among them.
    """
    count = curves.shape[1]
    if _straight(curves[:, :: max(1, count // 3)], tolerance) and _straight(curves, tolerance):
        return np.array([0, count - 1])
    keep = np.ones(count, bool)
    first, bent = 0, np.zeros((len(curves), count - 1))
    for size in _LEVELS:
        half, start = size // 2, -phase % size
        blocks = (count - 1 - start) // size
        if blocks < 1:
            break
        end = start + blocks * size
        middle, ends = curves[:, start + half : end : size], curves[:, start : end + 1 : size]
        # The distance from the chord of the whole block is at most the distance from the chord of a half
        # block plus the distance between the two chords, which is largest in the middle.
        halves = bent[:, (start - first) // half :][:, : 2 * blocks]
        bent = np.maximum(halves[:, ::2], halves[:, 1::2])
        bent += np.abs(middle - 0.5 * (ends[:, :-1] + ends[:, 1:]))
        keep[start:end].reshape(blocks, size)[(bent <= tolerance).all(axis=0), 1:] = False
        first = start
    return np.flatnonzero(keep)


def _straight(curves: np.ndarray, tolerance: float) -> bool:
    """Returns whether all curves are within the tolerance of their chords."""
    first, share = curves[:, :1], np.arange(curves.shape[1]) / max(1, curves.shape[1] - 1)
    return bool((np.abs(curves - first - (curves[:, -1:] - first) * share) <= tolerance).all())


@dataclass(frozen=True)
class RunFigures:
    """Figures of a run.

    Attributes:
        seconds: duration of the run, simulated time.
        rmse: per task, RMS of ‖x̃‖, m or rad.
        torque_share: largest ratio of a commanded |τ| to its bound; NaN if the controller commands no torque.
        unsolved: number of QPs without a solution.
        step_ms, slow_ms: median and 99th percentile of the control step's time, ms, to 3 %.
    """

    seconds: float
    rmse: dict[str, float]
    torque_share: float
    unsolved: int
    step_ms: float
    slow_ms: float


_PER_DECADE = 80  # number of bins in the histogram of step times
_DECADES = 8  # from 1 µs


class RunStatistics:
    """Adds up portions of rows in their order; `clear` begins a new run."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self.clear()

    def clear(self) -> None:
        self._ticks = 0
        self._squares = {task.name: 0.0 for task in self._layout.tasks}
        self._known = dict.fromkeys(self._squares, 0)
        self._share = 0.0
        self._times = np.zeros(_PER_DECADE * _DECADES, np.int64)
        self._unsolved = 0
        self._t = -1.0
        self._first = 0.0

    def append_rows(self, rows: np.ndarray) -> None:
        fields = self._layout.fields
        t = rows[:, fields["t"].start]
        if t[0] < self._t:
            self.clear()
        if self._ticks == 0:
            self._first = float(t[0])
        self._t = float(t[-1])
        self._ticks += len(rows)
        for name in self._squares:
            squares = (rows[:, fields[f"error/{name}"]] ** 2).sum(axis=1)
            known = np.isfinite(squares)
            self._squares[name] += float(squares[known].sum())
            self._known[name] += int(known.sum())
        self._share = max(self._share, self._torque_share(rows))
        self._unsolved += int(np.nansum(rows[:, fields["unsolved"]]))
        step = rows[:, fields["step_us"].start]
        bins = (_PER_DECADE * np.log10(np.maximum(step, 1.0))).astype(np.int64)
        self._times += np.bincount(np.minimum(bins, len(self._times) - 1), minlength=len(self._times))

    def _torque_share(self, rows: np.ndarray) -> float:
        fields = self._layout.fields
        if "tau_lower" not in fields:
            return 0.0
        tau = rows[:, fields["tau_demand"]]
        with np.errstate(all="ignore"):
            share = np.maximum(tau / rows[:, fields["tau_upper"]], tau / rows[:, fields["tau_lower"]])
        finite = share[np.isfinite(share)]
        return float(finite.max()) if finite.size else 0.0

    def result(self) -> RunFigures | None:
        """Returns the figures so far; None before the first row."""
        if not self._ticks:
            return None
        return RunFigures(
            seconds=self._t - self._first,
            rmse={
                name: float(np.sqrt(total / self._known[name])) if self._known[name] else float("nan")
                for name, total in self._squares.items()
            },
            torque_share=self._share if "tau_lower" in self._layout.fields else float("nan"),
            unsolved=self._unsolved,
            step_ms=self._quantile(0.5),
            slow_ms=self._quantile(0.99),
        )

    def _quantile(self, share: float) -> float:
        """Returns the time in ms below which the given share of the control steps stayed."""
        index = int(np.searchsorted(np.cumsum(self._times), share * self._ticks))
        return 1e-3 * float(10 ** ((index + 0.5) / _PER_DECADE))


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

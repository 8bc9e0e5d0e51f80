"""What a page keeps of a run: the last minute as the simulation sent it, older rows for files, and sums over
all ticks."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from app.link.messages import Status
from app.link.ring import Block

if TYPE_CHECKING:
    from himpc.telemetry import Layout

KEPT = 60.0
"""Simulated time, s, that the page can show again."""
RATE = 100.0
"""Number of rows that are stored per simulated second."""
FRAMES = 30.0
"""Number of frames that are stored per simulated second."""
MOST = 8_000
"""Largest number of rows that are stored of the time before the last minute. Of a longer run, every second,
fourth, … row is stored."""
WINDOW = 8.0
"""Simulated time, s, in the plots."""
BUCKETS = 160
"""Number of buckets in a window."""

_MINUTE = round(KEPT * RATE)
_SPAN = WINDOW / BUCKETS
_SLOTS = round((KEPT + WINDOW) / _SPAN)
_HELD = round(1.0 / _SPAN)
"""Largest number of buckets without a row (slow controller) that are filled from the bucket before them."""
_AGES = np.linspace(-WINDOW, 0.0, 2 * BUCKETS)
_LEVELS = (2, 4, 8, 16, 32)


@dataclass(frozen=True, eq=False)
class Frame:
    """t: s; poses: (J, 7), as in `Block`; status: the newest report at that time."""

    t: float
    poses: np.ndarray
    status: Status | None


class Recording:
    """The recording of a run, from which any moment of the last minute is shown again. It consists of

    - frames, the poses with the report at their time, at FRAMES;
    - rows exactly as the simulation wrote them, at RATE; of the time before the last minute, at first all of
      these rows, later every second, fourth, … of them;
    - for each bucket of simulated time, the minimum and the maximum of each column in the order of their
      times, as the plots also show peaks that are shorter than 1/RATE.

    If the controller is slower than the buckets, some buckets have no row; a row is then valid until the next
    row. Buckets are aligned to simulated time, so that curves scroll without shimmering, and two robots on
    one clock have the same buckets. Each row is read only once, whatever span of time the plots show. A reset
    sets the time back and deletes all, since a jump would look like a motion.

    Attributes:
        block: the shared memory that is recorded.
        latest: the newest row.
        bound_ticks: (n, number of constraints), the ticks since the last reset that each joint spent at the
            bound of each constraint.
        statistics: the sums over all ticks.
    """

    def __init__(self, block: Block, layout: Layout) -> None:
        from himpc.limits import CONSTRAINTS

        joints = layout.fields["at_bound"].stop - layout.fields["at_bound"].start
        self.block, self.layout = block, layout
        self.latest = np.full(layout.size, np.nan)
        self.bound_ticks = np.zeros((joints, len(CONSTRAINTS)))
        self._count = 0  # number of rows of the block that were read or lost
        self._t = layout.fields["t"].start
        self._frames: list[Frame] = []
        # These arrays are allocated once. A separate array per row would live for minutes among arrays that
        # live for an instant, and would fragment the memory. The arrays are not filled, as the system
        # provides a memory page at the first write, and most scenes are shown for less than a minute.
        self._rows = np.empty((_MINUTE, layout.size))  # a ring
        self._older = np.empty((MOST, layout.size))
        self._pairs = np.empty((_SLOTS, 2, layout.size))  # a ring, valid where `_numbers` has the bucket
        self._bits = np.zeros((_SLOTS, joints), np.int64)
        self._numbers = np.full(_SLOTS, -1)
        self._first = np.full(layout.size, np.nan)  # the open bucket's first row
        self._begin()

    def _begin(self) -> None:
        self.bound_ticks[:] = 0
        self.statistics = RunStatistics(self.layout)
        self._stored = 0  # number of rows that were stored at RATE
        self._every = 1  # one of this many rows becomes an older row
        self._mark = -1
        self._numbers[:] = -1
        self._bucket = -1

    def under(self, block: Block, layout: Layout) -> Recording:
        """Returns the same recording in the layout of another stack, with which the run continues in another
        block. The sums begin anew."""
        from himpc.telemetry import relaid

        def moved(rows: np.ndarray) -> np.ndarray:
            flat = rows.reshape(-1, self.layout.size)
            return relaid(flat, self.layout, layout).reshape(*rows.shape[:-1], layout.size)

        new = Recording(block, layout)
        new.latest, new._first = moved(self.latest), moved(self._first)
        known, stored, older = self._numbers >= 0, min(self._stored, _MINUTE), self._older_count
        new._pairs[known] = moved(self._pairs[known])
        new._rows[:stored], new._older[:older] = moved(self._rows[:stored]), moved(self._older[:older])
        for name in ("bound_ticks", "_frames", "_stored", "_every", "_mark", "_numbers", "_bits", "_bucket"):
            setattr(new, name, getattr(self, name))
        return new

    # ---------------------------------------------------------------- recording

    def look(self, status: Status | None, rows: bool = True) -> float:
        """Records what is new in the block, and returns the simulated time, s. status: the newest report;
        rows: whether to read the telemetry too; otherwise one of the next calls reads it."""
        t, poses = self.block.moment()
        if rows:
            self.pull()  # read after the moment, so that the rows reach up to it
        self.add(Frame(t, poses, status))
        return t

    def pull(self) -> None:
        """Records the rows that were written since the last call."""
        start, rows = self.block.since(self._count)
        if len(rows):
            self._count = start + len(rows)
            self.take(rows)

    def add(self, frame: Frame) -> None:
        """Records the newest frame. If the previous frame is closer than 1/FRAMES to the frame before it, the
        newest frame replaces the previous frame. Thus slow motion needs no more memory."""
        frames = self._frames
        if frames and frame.t < frames[-1].t:
            frames.clear()
        if len(frames) > 1 and frames[-1].t - frames[-2].t < 1 / FRAMES - 1e-9:
            frames.pop()
        frames.append(frame)
        # The limit is a time, not a number of frames, as a busy machine gives fewer frames per second.
        del frames[: self._index(frame.t - KEPT)]

    def take(self, rows: np.ndarray) -> None:
        """Records rows, (k, size) in order of time. A time that is earlier than the one before it begins a
        new run."""
        turns = np.flatnonzero(np.diff(rows[:, self._t], prepend=self.latest[self._t]) < 0)
        if turns.size:
            self._begin()
            rows = rows[turns[-1] :]
        times = rows[:, self._t]
        bits = rows[:, self.layout.fields["at_bound"]]
        bits = np.where(np.isfinite(bits), bits, 0).astype(np.int64)
        each = 1 << np.arange(self.bound_ticks.shape[1])
        self.bound_ticks += np.count_nonzero(bits[:, :, None] & each, axis=0)
        marks = np.floor(times * RATE + 1e-6).astype(np.int64)
        for k in np.flatnonzero(np.diff(marks, prepend=self._mark)):
            self._store(rows[k])
        self._mark = int(marks[-1])
        buckets = np.floor(times / _SPAN + 1e-6).astype(np.int64)
        starts = np.flatnonzero(np.diff(buckets, prepend=buckets[0] - 1)).tolist()
        for start, end in pairwise([*starts, len(rows)]):
            self._hold(int(buckets[start]))
            self._merge(int(buckets[start]), rows[start:end], bits[start:end])
            self.latest = rows[end - 1]
        self.latest = self.latest.copy()  # as a view, it would keep all rows in memory
        self.statistics.append_rows(rows)

    def _store(self, row: np.ndarray) -> None:
        """Stores a row in the ring; the row that it replaces there becomes one of the older rows."""
        slot, old = self._stored % _MINUTE, self._stored - _MINUTE
        if old == MOST * self._every:
            self._older[: MOST // 2] = self._older[::2].copy()
            self._every *= 2
        if old >= 0 and old % self._every == 0:
            self._older[old // self._every] = self._rows[slot]
        self._rows[slot] = row
        self._stored += 1

    def _hold(self, until: int) -> None:
        """Fills the buckets between the newest bucket and the bucket `until` with the newest row."""
        before = self._bucket % _SLOTS
        if self._bucket < 0 or until - self._bucket > _HELD:
            return
        for bucket in range(self._bucket + 1, until):
            slot = bucket % _SLOTS
            self._numbers[slot], self._bits[slot] = bucket, self._bits[before]
            self._pairs[slot] = self.latest

    def _merge(self, bucket: int, rows: np.ndarray, bits: np.ndarray) -> None:
        slot = bucket % _SLOTS
        pair, low, high = self._pairs[slot], rows.min(axis=0), rows.max(axis=0)
        if self._numbers[slot] != bucket:
            self._numbers[slot] = bucket
            self._bits[slot] = 0
            self._first = rows[0].copy()
        else:
            low, high = np.fmin(pair.min(axis=0), low), np.fmax(pair.max(axis=0), high)
        rising = rows[-1] >= self._first
        pair[0], pair[1] = np.where(rising, low, high), np.where(rising, high, low)
        self._bits[slot] |= np.bitwise_or.reduce(bits, axis=0)
        self._bucket = bucket

    @property
    def full(self) -> bool:
        """Whether further rows need no further memory. A slow page loses rows of a fast simulation, and its
        recording is full later."""
        return self._stored >= _MINUTE + MOST

    # ---------------------------------------------------------------- looking back

    @property
    def span(self) -> tuple[float, float]:
        """Times of the first and the last frame that can be shown, s; (0, 0) if there are none."""
        if not self._frames:
            return 0.0, 0.0
        last = self._frames[-1].t
        return max(self._frames[0].t, last - KEPT), last

    def frame(self, t: float) -> Frame | None:
        """Returns the frame at time t (s): poses interpolated between the two nearest frames, with the report
        of the earlier frame."""
        if not self._frames:
            return None
        k = self._index(t)
        before = self._frames[max(k - 1, 0)]
        if k == 0 or k == len(self._frames):
            return before
        after = self._frames[k]
        share = (t - before.t) / (after.t - before.t)
        return Frame(t, _between(before.poses, after.poses, share), before.status)

    def frames(self, start: float, end: float) -> list[Frame]:
        """Returns the frames from `start` to `end`, s."""
        return self._frames[self._index(start) : self._index(end)]

    def _index(self, t: float) -> int:
        return bisect_right(self._frames, t, key=lambda frame: frame.t)

    def row(self, t: float) -> np.ndarray:
        """Returns the newest row at time t (s), as precisely as rows are stored."""
        if not t < self.latest[self._t]:
            return self.latest
        stored = self._in_ring
        k = bisect_right(stored, t + 1e-6, key=lambda k: self._rows[k % _MINUTE, self._t])
        return self._rows[stored[max(k - 1, 0)] % _MINUTE].copy()

    def window(self, until: float | None = None) -> PlotWindow:
        """Returns the curves for the plots up to time `until` (s); None: the present time."""
        end = self._bucket if until is None else int(np.floor(until / _SPAN + 1e-6))
        return PlotWindow(self, end)

    def minute(self) -> np.ndarray:
        """Returns the rows of the last minute at RATE, (k, size)."""
        rows = self._ring()
        return rows[rows[:, self._t] > self.latest[self._t] - KEPT]

    def whole(self) -> np.ndarray:
        """Returns the rows since the last reset, evenly spaced, as densely as the older ones, (k, size)."""
        due = -self._in_ring.start % self._every
        return np.vstack([self._older[: self._older_count], self._ring()[due :: self._every]])

    def _ring(self) -> np.ndarray:
        return self._rows[np.array(self._in_ring, int) % _MINUTE]

    @property
    def _in_ring(self) -> range:
        """The numbers of the rows in the ring, counted since the last reset."""
        return range(max(0, self._stored - _MINUTE), self._stored)

    @property
    def _older_count(self) -> int:
        """The number of older rows that are stored."""
        return -(-self._in_ring.start // self._every)


def _between(before: np.ndarray, after: np.ndarray, share: float) -> np.ndarray:
    # q and −q are the same rotation. Frames are close, so linear interpolation is good enough for
    # quaternions.
    near = np.where((before[:, 3:] * after[:, 3:]).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    there = np.hstack([after[:, :3], near * after[:, 3:]])
    found = (1 - share) * before + share * there
    found[:, 3:] /= np.linalg.norm(found[:, 3:], axis=1, keepdims=True)
    return found


class PlotWindow:
    """The curves of the plots at one moment: BUCKETS pairs of values, oldest first."""

    def __init__(self, recording: Recording, end: int) -> None:
        """end: number of the newest bucket, counted from the start of the run."""
        self.layout = recording.layout
        self.first = 2 * (end - BUCKETS + 1)
        """Number of the oldest value; it may be negative."""
        wanted = np.arange(end - BUCKETS + 1, end + 1)
        newest = recording._bucket
        wanted[(wanted > newest) & (wanted <= newest + _HELD)] = newest
        self._slots = wanted % _SLOTS
        self._known = (recording._numbers[self._slots] == wanted) & (wanted >= 0)
        self._pairs, self._bits = recording._pairs, recording._bits

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
    """Adds up the rows of a run, portion by portion in their order."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._ticks = 0
        self._squares = {task.name: 0.0 for task in self._layout.tasks}
        self._known = dict.fromkeys(self._squares, 0)
        self._share = 0.0
        self._times = np.zeros(_PER_DECADE * _DECADES, np.int64)
        self._unsolved = 0
        self._first = self._t = 0.0

    def append_rows(self, rows: np.ndarray) -> None:
        fields = self._layout.fields
        t = rows[:, fields["t"].start]
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

"""The last minute of a robot's motion, for looking back."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from app.client.decimated import KEPT
from app.link.messages import Status

RATE = 30.0
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
        """Adds the newest frame. If the previous frame is closer than 1/RATE to the frame before it, the
        newest frame replaces the previous frame. Thus slow motion needs no more memory."""
        frames = self._frames
        if frames and frame.t < frames[-1].t:
            frames.clear()
        if len(frames) > 1 and frames[-1].t - frames[-2].t < 1 / RATE - 1e-9:
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

"""Motions through points: straight and quintic paths, and the square wave, which jumps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from himpc.references.preview import Preview, sampled, times
from robots import InputError
from robots.arrays import Array
from robots.errors import unknown_name


@dataclass(frozen=True, eq=False)
class Waypoints:
    """x_d moves through points and is at rest at each point, with s(σ) = 10σ³ − 15σ⁴ + 6σ⁵ on every segment.

    Attributes:
        points: (P, m) waypoints, P ≥ 1.
        arrivals: (P,) increasing times in seconds at which the points are reached. Before the first and after
            the last of these times, the reference is constant.
    """

    points: Array
    arrivals: Array

    def __post_init__(self) -> None:
        if len(self.points) != len(self.arrivals) or (np.diff(self.arrivals) <= 0).any():
            raise ValueError("each waypoint needs an arrival time, and the times must increase strictly")

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        clock = times(t, T_s, N)
        if len(self.points) == 1:
            still = np.repeat(self.points, N + 1, axis=0)
            return sampled(still, np.zeros_like(still), np.zeros_like(still))
        segment = np.clip(np.searchsorted(self.arrivals, clock, side="right") - 1, 0, len(self.points) - 2)
        start, duration = self.arrivals[segment], np.diff(self.arrivals)[segment][:, None]
        step = np.diff(self.points, axis=0)[segment]
        s = np.clip((clock - start)[:, None] / duration, 0.0, 1.0)
        return sampled(
            self.points[segment] + step * (s**3 * (10 - 15 * s + 6 * s * s)),
            step * (30 * s * s * (1 - s) ** 2) / duration,
            step * (60 * s * (1 - s) * (1 - 2 * s)) / duration**2,
        )


Law = Literal["straight", "quintic"]
LAWS: tuple[Law, ...] = get_args(Law)

_PEAK = 1.875
"""Largest derivative of 10σ³ − 15σ⁴ + 6σ⁵. The mean speed of a quintic segment is its peak speed divided by
this number."""
_SAME = 1e-9
"""Points that are closer than this, m, count as one point."""


@dataclass(frozen=True, eq=False)
class Path:
    """x_d follows the straight lines between points, at most at the cruise speed.

    With `straight`, x_d moves at the cruise speed all the time: the velocity jumps at the start, at corners
    and at the end. With `quintic`, x_d is at rest at every point and reaches the cruise speed in the middle
    of each line; its acceleration is continuous. Before `start` and after the end x_d is constant.

    Attributes:
        points: (P, m) m, P ≥ 1; the motion starts at the first point.
        cruise: largest speed, m/s.
        law: "straight" or "quintic".
        start: start time of the motion, s.
    """

    points: Array
    cruise: float
    law: Law = "quintic"
    start: float = 0.0

    def __post_init__(self) -> None:
        """Raises InputError for an invalid speed, law or point."""
        if not (np.isfinite(self.cruise) and self.cruise > 0):
            raise InputError(f"cruise speed is {self.cruise} m/s: give a finite number above 0, e.g. 0.5")
        if self.law not in LAWS:
            raise unknown_name("law of a path", self.law, LAWS)
        if self.points.ndim != 2 or not len(self.points) or not np.isfinite(self.points).all():
            raise InputError("a path needs at least one point of finite coordinates")

    @property
    def duration(self) -> float:
        """Time from start to end, s."""
        return float(self._arrivals[-1])

    @cached_property
    def _corners(self) -> Array:
        apart = np.linalg.norm(np.diff(self.points, axis=0), axis=1) > _SAME
        return self.points[np.append(True, apart)]

    @cached_property
    def _arrivals(self) -> Array:
        """Times at which the corners are reached, in s after the start."""
        lengths = np.linalg.norm(np.diff(self._corners, axis=0), axis=1)
        slower = _PEAK if self.law == "quintic" else 1.0
        return np.append(0.0, np.cumsum(lengths)) * slower / self.cruise

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        since = t - self.start
        if self.law == "quintic" or len(self._corners) == 1:
            return Waypoints(self._corners, self._arrivals).preview(since, T_s, N)
        clock = times(since, T_s, N)
        position = np.array([np.interp(clock, self._arrivals, axis) for axis in self._corners.T]).T
        line = np.clip(np.searchsorted(self._arrivals, clock, side="right") - 1, 0, len(self._corners) - 2)
        moving = (clock >= 0) & (clock < self.duration)
        slopes = np.diff(self._corners, axis=0) / np.diff(self._arrivals)[:, None]
        return sampled(position, slopes[line] * moving[:, None], np.zeros_like(position))


_EARLY = 1e-9
"""A switch takes place earlier by this time, s, so that the rounding error of a sum of periods cannot delay
the switch by a sample."""


@dataclass(frozen=True, eq=False)
class SquareWave:
    """x_d is at the peak for half a period and then in the valley for half a period, repeatedly. ẋ_d = ẍ_d =
    0.

    Attributes:
        peak, valley: (m,) m.
        half_period: duration of half a period, s.
        waves: number of periods, after which x_d stays in the valley; None: the wave never ends.
    """

    peak: Array
    valley: Array
    half_period: float = 8.0
    waves: int | None = None

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        half = np.floor((times(t, T_s, N) + _EARLY) / self.half_period)
        down = half % 2 == 1
        if self.waves is not None:
            down |= half >= 2 * self.waves
        position = np.where(down[:, None], self.valley, self.peak)
        return sampled(position, np.zeros_like(position), np.zeros_like(position))

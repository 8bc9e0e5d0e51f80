"""Straight segments between waypoints with a quintic time law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from himpc.references.preview import Array, Preview, sampled, times


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

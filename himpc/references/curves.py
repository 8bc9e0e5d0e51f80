"""Closed curves through a phase: ellipses (a circle is one) and the figure-eight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from himpc.references.phase import Phase
from himpc.references.preview import Array, Preview, sampled, times


@dataclass(frozen=True, eq=False)
class Circle:
    """x_d = centre + u cos φ(t) + w sin φ(t).

    Attributes:
        centre: (m,) m.
        u, w: (m,) half axes; a circle if they are orthogonal and of equal length.
        phase: time law φ(t).
    """

    centre: Array
    u: Array
    w: Array
    phase: Phase

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        phi, rate, acceleration = self.phase.at(times(t, T_s, N))
        cos, sin = np.cos(phi), np.sin(phi)
        # Components along u and w: outward (cos, sin), along the tangent (−sin, cos).
        part = np.empty((3, N + 1, 2))
        part[0, :, 0], part[0, :, 1] = cos, sin
        part[1, :, 0], part[1, :, 1] = -rate * sin, rate * cos
        square = rate * rate
        part[2, :, 0] = -acceleration * sin - square * cos
        part[2, :, 1] = acceleration * cos - square * sin
        outward, velocity, curvature = part @ np.array((self.u, self.w))
        return sampled(self.centre + outward, velocity, curvature)


@dataclass(frozen=True, eq=False)
class FigureEight:
    """x_d = centre + u sin φ(t) + w sin 2φ(t)/2, the lemniscate of Gerono."""

    centre: Array
    u: Array
    w: Array
    phase: Phase

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        phi, rate, acceleration = self.phase.at(times(t, T_s, N))
        axes = np.array((self.u, self.w))
        position = np.stack((np.sin(phi), 0.5 * np.sin(2 * phi)), axis=1) @ axes
        first = np.stack((np.cos(phi), np.cos(2 * phi)), axis=1) @ axes
        second = np.stack((-np.sin(phi), -2 * np.sin(2 * phi)), axis=1) @ axes
        rate, acceleration = np.reshape(rate, (-1, 1)), np.reshape(acceleration, (-1, 1))
        return sampled(self.centre + position, rate * first, acceleration * first + rate * rate * second)


@dataclass(frozen=True, eq=False)
class Sinusoid:
    """x_d = offset + amplitude sin φ(t), componentwise."""

    offset: Array
    amplitude: Array
    phase: Phase

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        phi, rate, acceleration = self.phase.at(times(t, T_s, N))
        cos, sin = np.cos(phi), np.sin(phi)
        return sampled(
            self.offset + np.multiply.outer(sin, self.amplitude),
            np.multiply.outer(rate * cos, self.amplitude),
            np.multiply.outer(acceleration * cos - rate * rate * sin, self.amplitude),
        )

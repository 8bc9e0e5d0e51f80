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
        phi, rate, acceleration = (row[:, None] for row in self.phase.at(times(t, T_s, N)))
        cos, sin = np.cos(phi), np.sin(phi)
        outward = cos * self.u + sin * self.w
        tangent = cos * self.w - sin * self.u
        return sampled(self.centre + outward, rate * tangent, acceleration * tangent - rate * rate * outward)


@dataclass(frozen=True, eq=False)
class FigureEight:
    """x_d = centre + u sin φ(t) + w sin 2φ(t)/2, the lemniscate of Gerono."""

    centre: Array
    u: Array
    w: Array
    phase: Phase

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        phi, rate, acceleration = (row[:, None] for row in self.phase.at(times(t, T_s, N)))
        first = np.cos(phi) * self.u + np.cos(2 * phi) * self.w
        second = -np.sin(phi) * self.u - 2 * np.sin(2 * phi) * self.w
        position = self.centre + np.sin(phi) * self.u + 0.5 * np.sin(2 * phi) * self.w
        return sampled(position, rate * first, acceleration * first + rate * rate * second)


@dataclass(frozen=True, eq=False)
class Sinusoid:
    """x_d = offset + amplitude sin φ(t), componentwise."""

    offset: Array
    amplitude: Array
    phase: Phase

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        phi, rate, acceleration = (row[:, None] for row in self.phase.at(times(t, T_s, N)))
        cos, sin = np.cos(phi), np.sin(phi)
        return sampled(
            self.offset + self.amplitude * sin,
            self.amplitude * rate * cos,
            self.amplitude * (acceleration * cos - rate * rate * sin),
        )

"""Closed curves as functions of a phase: ellipses (circles included) and the figure-eight."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from himpc.references.phase import Phase, column
from himpc.references.preview import Array, Preview, sampled, times


@dataclass(frozen=True, eq=False)
class Circle:
    """x_d = centre + u cos φ(t) + w sin φ(t).

    Attributes:
        centre: (m,) m.
        u, w: (m,) half axes; the curve is a circle if they are orthogonal and of equal length.
        phase: time law φ(t).
    """

    centre: Array
    u: Array
    w: Array
    phase: Phase

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        phi, rate, acceleration = self.phase.at(times(t, T_s, N))
        turn = np.empty((N + 1, 2))
        np.cos(phi, out=turn[:, 0])
        np.sin(phi, out=turn[:, 1])
        outward, tangent = turn.dot(self._axes[0]), turn.dot(self._axes[1])
        rate, acceleration = column(rate), column(acceleration)
        return sampled(self.centre + outward, rate * tangent, acceleration * tangent - rate * rate * outward)

    @cached_property
    def _axes(self) -> tuple[Array, Array]:
        """Two matrices. Their products with (cos φ, sin φ) are the position without the centre, and its
        derivative with respect to φ."""
        return np.array((self.u, self.w)), np.array((self.w, -self.u))


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
        rate, acceleration = column(rate), column(acceleration)
        return sampled(self.centre + position, rate * first, acceleration * first + rate * rate * second)


@dataclass(frozen=True, eq=False)
class Sinusoid:
    """x_d = offset + amplitude sin φ(t), componentwise."""

    offset: Array
    amplitude: Array
    phase: Phase

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        phi, rate, acceleration = self.phase.at(times(t, T_s, N))
        swing = np.sin(phi)[:, None] * self.amplitude
        slope = np.cos(phi)[:, None] * self.amplitude
        rate, acceleration = column(rate), column(acceleration)
        return sampled(self.offset + swing, rate * slope, acceleration * slope - rate * rate * swing)

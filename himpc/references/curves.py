"""Motions that a few coefficients describe: constants, ellipses (circles included), the figure-eight and
sinusoids, with the time laws of their phases."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal, NamedTuple

import numpy as np

from himpc.references.preview import Preview, Reference, sampled, times
from robots.arrays import Array


@dataclass(frozen=True)
class Phase:
    """A phase φ(t), its rate and its acceleration.

    The law `uniform` is φ = ωt + φ₀. The law `eased` is φ = ωt − sin ωt + φ₀; each turn starts and ends at
    rest.

    Attributes:
        omega: angular frequency ω, rad/s.
        law: "uniform" or "eased".
        offset: φ₀, rad.
    """

    omega: float
    law: Literal["uniform", "eased"] = "uniform"
    offset: float = 0.0

    def at(self, t: Array) -> tuple[Array, Array | float, Array | float]:
        """Returns (φ, φ̇, φ̈) at times t in seconds; constant derivatives are plain numbers."""
        w, wt = self.omega, self.omega * t
        if self.law == "uniform":
            return wt + self.offset, w, 0.0
        return wt - np.sin(wt) + self.offset, w * (1 - np.cos(wt)), w * w * np.sin(wt)


def column(rate: Array | float) -> Array | float:
    """Returns an array with one rate per sample as a column, which can be multiplied by rows of coordinates.
    A plain number is returned unchanged."""
    return rate[:, None] if isinstance(rate, np.ndarray) else rate


@dataclass(frozen=True, eq=False)
class Hold:
    """A constant x_d.

    Attributes:
        value: (m,) coordinates, or a rotation matrix (3, 3).
        m: number of coordinates that the task controls. It is needed only if it differs from the size of the
            value (an orientation task on fewer than three axes).
    """

    value: Array
    m: int | None = None

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        rest = still(N, self.m or self.value.shape[0])
        return Preview(self.value, rest.displacement, rest.velocity, rest.acceleration)


@lru_cache(maxsize=64)
def still(N: int, m: int) -> Preview:
    """Returns the preview of m coordinates that rest at zero."""
    zeros = np.zeros((N + 1, m))
    zeros.setflags(write=False)
    return Preview(zeros[0], zeros, zeros, zeros)


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


class Curve(NamedTuple):
    """x_d = c + a cos φ + b sin φ + d sin 2φ.

    Attributes:
        centre: c, (m,); or a constant rotation matrix.
        swing: a, b and d, each (m,) or 0.
        phase: time law φ(t); None: x_d is constant at `centre`.
    """

    centre: Array
    swing: tuple[Array | float, Array | float, Array | float] = (0.0, 0.0, 0.0)
    phase: Phase | None = None


def curve_of(reference: Reference) -> Curve | None:
    """Returns the coefficients of a reference; None for a reference that can only be sampled by `preview`."""
    match reference:
        case Hold():
            return Curve(reference.value)
        case Circle():
            return Curve(reference.centre, (reference.u, reference.w, 0.0), reference.phase)
        case FigureEight():
            return Curve(reference.centre, (0.0, reference.u, 0.5 * reference.w), reference.phase)
        case Sinusoid():
            return Curve(reference.offset, (0.0, reference.amplitude, 0.0), reference.phase)
        case _:
            return None

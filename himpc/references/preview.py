"""The preview of a task's desired motion that the controller receives: the present value and the motion over
the horizon."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from robots.arrays import Array


class Preview(NamedTuple):
    """x̄_d = col(x_d, ẋ_d, ẍ_d) of (28) at k … k+N.

    Attributes:
        value: x_d at k: (m,) or a rotation matrix (3, 3).
        displacement: x_d(k+j) ⊖ x_d(k), j = 0 … N, (N+1, m); for rotations the vector log₃(R_d(k+j) R_d(k)ᵀ),
            (N+1, 3). For a task on fewer axes, it may contain only the components along these axes; the other
            components are then zero.
        velocity: ẋ_d at k+j, (N+1, m); ω_d for rotations.
        acceleration: ẍ_d at k+j, (N+1, m).
    """

    value: Array
    displacement: Array
    velocity: Array
    acceleration: Array


class Reference(Protocol):
    """A desired motion as a function of time."""

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        """Returns the desired motion at t, t + T_s, …, t + N·T_s (seconds)."""
        ...


def previews(references: Mapping[str, Reference], t: float, T_s: float, N: int) -> dict[str, Preview]:
    """Returns the argument `previews` of a controller's `step`: the preview of each task's reference at t
    (s)."""
    return {name: reference.preview(t, T_s, N) for name, reference in references.items()}


def sampled(position: Array, velocity: Array, acceleration: Array) -> Preview:
    """Returns the preview of a vector-valued motion from its samples, each (N+1, m)."""
    return Preview(position[0], position - position[0], velocity, acceleration)


def times(t: float, T_s: float, N: int) -> Array:
    """Returns t + T_s·(0 … N), seconds."""
    return t + _offsets(T_s, N)


@lru_cache(maxsize=64)
def _offsets(T_s: float, N: int) -> Array:
    return np.asarray(T_s * np.arange(N + 1), np.float64)

"""Sequences over the horizon with bounds on their values and on their steps, joint by joint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def steps(x: Array) -> Array:
    """Returns the steps x_j − x_{j−1}, where x_{−1} = 0."""
    return np.diff(x, axis=0, prepend=np.zeros((1, x.shape[1])))


def clamped(x: Array, low: Array, high: Array) -> Array:
    """Returns x clipped to the bounds. If the bounds contradict each other, the upper bound is satisfied."""
    return np.minimum(np.maximum(x, low), high)


def viable(low: Array, high: Array, least: Array, most: Array) -> tuple[Array, Array]:
    """Returns, for each x_j, the interval from which all later bounds can still be satisfied. The bounds are
    low ≤ x_j ≤ high and least ≤ x_j − x_{j−1} ≤ most, (N, n) each. The computation begins at the last
    knot."""
    low, high = low.copy(), high.copy()
    for j in range(len(low) - 2, -1, -1):
        behind_low, behind_high = low[j + 1] - most[j + 1], high[j + 1] - least[j + 1]
        low[j], high[j] = clamped(behind_low, low[j], high[j]), clamped(behind_high, low[j], high[j])
    return low, high

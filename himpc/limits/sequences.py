"""Sequences over the horizon whose values and steps are bounded, joint by joint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def steps(x: Array) -> Array:
    """x_j − x_{j−1}, where x_{−1} = 0."""
    return np.diff(x, axis=0, prepend=np.zeros((1, x.shape[1])))


def clamped(x: Array, low: Array, high: Array) -> Array:
    """Returns x within the bounds; of contradicting bounds the upper one holds."""
    return np.minimum(np.maximum(x, low), high)


def viable(low: Array, high: Array, least: Array, most: Array) -> tuple[Array, Array]:
    """Returns the interval of each value from which all later bounds can still be met, going back from the
    last knot: low ≤ x_j ≤ high and least ≤ x_j − x_{j−1} ≤ most, (N, n) each."""
    low, high = low.copy(), high.copy()
    for j in range(len(low) - 2, -1, -1):
        behind_low, behind_high = low[j + 1] - most[j + 1], high[j + 1] - least[j + 1]
        low[j], high[j] = clamped(behind_low, low[j], high[j]), clamped(behind_high, low[j], high[j])
    return low, high

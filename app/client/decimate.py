"""Reduces the number of points of curves without a visible change."""

from __future__ import annotations

import numpy as np

_LEVELS = (2, 4, 8, 16, 32)


def decimate(curves: np.ndarray, tolerance: float, phase: int = 0) -> np.ndarray:
    """Selects the points that are needed to draw some curves within a tolerance.

    The points are equally spaced. In a block of 2, 4, … 32 points, only the two ends are kept if every curve
    is nearly straight in this block. Blocks are aligned to the points' numbers, so that a scrolling curve
    loses the same points in every picture and does not shimmer.

    Args:
        curves: (k, m), finite.
        tolerance: largest deviation from the original curve, in the curves' unit.
        phase: number of the first point.

    Returns:
        Numbers of the points to keep, ascending; the first and the last are among them.
    """
    count = curves.shape[1]
    if _straight(curves[:, :: max(1, count // 3)], tolerance) and _straight(curves, tolerance):
        return np.array([0, count - 1])
    keep = np.ones(count, bool)
    first, bent = 0, np.zeros((len(curves), count - 1))
    for size in _LEVELS:
        half, start = size // 2, -phase % size
        blocks = (count - 1 - start) // size
        if blocks < 1:
            break
        end = start + blocks * size
        middle, ends = curves[:, start + half : end : size], curves[:, start : end + 1 : size]
        # The distance from the chord of the whole block is at most the distance from the chord of a half
        # block plus the distance between the two chords, which is largest in the middle.
        halves = bent[:, (start - first) // half :][:, : 2 * blocks]
        bent = np.maximum(halves[:, ::2], halves[:, 1::2])
        bent += np.abs(middle - 0.5 * (ends[:, :-1] + ends[:, 1:]))
        keep[start:end].reshape(blocks, size)[(bent <= tolerance).all(axis=0), 1:] = False
        first = start
    return np.flatnonzero(keep)


def _straight(curves: np.ndarray, tolerance: float) -> bool:
    """Returns whether all curves are within the tolerance of their chords."""
    first, share = curves[:, :1], np.arange(curves.shape[1]) / max(1, curves.shape[1] - 1)
    return bool((np.abs(curves - first - (curves[:, -1:] - first) * share) <= tolerance).all())

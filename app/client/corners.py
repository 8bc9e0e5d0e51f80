"""Curves without the points that nobody would miss."""

from __future__ import annotations

import numpy as np

_LEVELS = (2, 4, 8, 16, 32)


def corners(curves: np.ndarray, tolerance: float, phase: int = 0) -> np.ndarray:
    """Which points of some curves are needed to draw them all.

    Points lie at equal distances. Of a block of 2, 4, … 32 only the ends are kept where every curve is
    as good as straight. Blocks are aligned to the points' numbers: of curves that slide past, the same points
    are left out from picture to picture, and nothing shimmers.

    Args:
        curves: (k, m), finite.
        tolerance: how far a curve may then be from what it was, in the curves' unit.
        phase: number of the first point.

    Returns:
        Numbers of the points to keep, ascending; the first and the last are among them.
    """
    count = curves.shape[1]
    if _straight(curves[:, None, :-1], curves[:, None, -1], tolerance).all():
        return np.array([0, count - 1])
    keep = np.ones(count, bool)
    for size in _LEVELS:
        first = -phase % size
        blocks = (count - 1 - first) // size
        if blocks < 1:
            break
        end = first + blocks * size
        inside = curves[:, first:end].reshape(len(curves), blocks, size)
        straight = _straight(inside, curves[:, first + size : end + 1 : size], tolerance)
        keep[first:end].reshape(blocks, size)[straight, 1:] = False
    return np.flatnonzero(keep)


def _straight(blocks: np.ndarray, ends: np.ndarray, tolerance: float) -> np.ndarray:
    """(blocks,) whether each is. blocks (k, blocks, size) of k curves; ends (k, blocks): the next points."""
    share = np.arange(blocks.shape[2]) / blocks.shape[2]
    start = blocks[:, :, :1]
    line = start + (ends[:, :, None] - start) * share
    return np.abs(blocks - line).max(axis=(0, 2), initial=0.0) <= tolerance

"""Entries: where joints and frames are along a plan."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from himpc.compilation.compiled import INDICES, MATRICES, MATRIX, TABLE, entry
from himpc.compilation.views import borrowed
from himpc.tick.kernel.kinematics import frame_rotation, jacobian, place, points

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@entry(INDICES, INDICES, MATRICES, MATRIX, MATRIX, MATRIX, MATRICES, MATRICES)
def place_all(
    parent: Indices, turns: Indices, turn: Array, shift: Array, axis: Array, q: Array, placed: Array, z: Array
) -> None:
    """`place` at configurations q (K, n); placed (K, n+1, 12) and z (K, n+1, 3) are the result."""
    turn, shift, axis, q = borrowed(turn), borrowed(shift), borrowed(axis), borrowed(q)
    placed, z = borrowed(placed), borrowed(z)
    for k in range(len(q)):
        place(q[k], parent, turns, turn, shift, axis, placed[k], z[k])


@entry(
    TABLE, INDICES, INDICES, INDICES, MATRICES, MATRICES, INDICES, MATRIX, MATRIX, MATRICES, MATRIX, MATRICES
)
def frame_along(
    task: Indices,
    part: Indices,
    parent: Indices,
    turns: Indices,
    placed: Array,
    z: Array,
    joint: Indices,
    turn: Array,
    shift: Array,
    R: Array,
    p: Array,
    J: Array,
) -> None:
    """A frame where the joints are placed.

    Args:
        task, part: the tasks whose rows are asked for, see `jacobian`.
        parent, turns: of the joints. placed, z: from `place_all`.
        joint: (1,) that carries the frame. turn, shift: its axes (3, 3) and origin (1, 3) there.
        R, p, J: the result, (K, 3, 3), (K, 3) and (K, m, n).
    """
    placed, z, turn, shift = borrowed(placed), borrowed(z), borrowed(turn), borrowed(shift)
    R, p, J = borrowed(R), borrowed(p), borrowed(J)
    for k in range(len(p)):
        here = p[k : k + 1]
        points(placed[k], joint, shift, here)
        frame_rotation(placed[k, joint[0]], turn, R[k])
        jacobian(task, part, parent, turns, placed[k], z[k], joint, here, shift, J[k])

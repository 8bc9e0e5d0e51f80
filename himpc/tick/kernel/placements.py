"""The placements of all joints at many configurations at once."""

from __future__ import annotations

from himpc.compilation.compiled import INDICES, MATRICES, MATRIX, kernel
from himpc.compilation.views import borrowed
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.kinematics import forward_kinematics


@kernel(INDICES, INDICES, MATRICES, MATRIX, MATRIX, MATRIX, MATRICES, MATRICES)
def place_all(
    parent: IntArray,
    is_revolute: IntArray,
    rotation: Array,
    translation: Array,
    axis: Array,
    q: Array,
    placed: Array,
    z: Array,
) -> None:
    """Applies `forward_kinematics` to configurations q (K, n). Results: placed (K, n+1, 12) and z
    (K, n+1, 3)."""
    rotation, translation, axis, q = borrowed(rotation), borrowed(translation), borrowed(axis), borrowed(q)
    placed, z = borrowed(placed), borrowed(z)
    for k in range(len(q)):
        forward_kinematics(q[k], parent, is_revolute, rotation, translation, axis, placed[k], z[k])

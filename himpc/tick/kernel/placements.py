"""The placements of all joints at many configurations at once."""

from __future__ import annotations

from himpc.compilation.compiled import INDICES, MATRICES, MATRIX, VECTOR, kernel
from himpc.compilation.views import borrowed
from himpc.tick.kernel.arrays import Array, IntArray
from himpc.tick.kernel.kinematics import forward_kinematics


@kernel(INDICES, INDICES, INDICES, VECTOR, MATRICES, MATRIX, MATRIX, MATRIX, MATRICES, MATRICES)
def place_all(
    parent: IntArray,
    is_revolute: IntArray,
    column: IntArray,
    factor: Array,
    rotation: Array,
    translation: Array,
    axis: Array,
    q: Array,
    placed: Array,
    z: Array,
) -> None:
    """Applies `forward_kinematics` to configurations q (K, n). Results: placed (K, J, 12) and z
    (K, J, 3)."""
    rotation, translation, axis, q = borrowed(rotation), borrowed(translation), borrowed(axis), borrowed(q)
    placed, z = borrowed(placed), borrowed(z)
    for k in range(len(q)):
        forward_kinematics(
            q[k], parent, is_revolute, column, factor, rotation, translation, axis, placed[k], z[k]
        )

"""Compiled positions and orientations of frames along a plan."""

from __future__ import annotations

from himpc.compilation.compiled import INDICES, MATRICES, MATRIX, TABLE, VECTOR, kernel
from himpc.compilation.views import borrowed
from himpc.tick.kernel.kinematics import jacobian, points, rotation_of_frame
from robots.arrays import Array, Indices


@kernel(
    *(TABLE, INDICES, INDICES, INDICES, INDICES, VECTOR, MATRICES, MATRICES),
    *(INDICES, MATRIX, MATRIX, MATRICES, MATRIX, MATRICES),
)
def frame_along(
    task: Indices,
    part: Indices,
    parent: Indices,
    is_revolute: Indices,
    column: Indices,
    factor: Array,
    placed: Array,
    z: Array,
    joint: Indices,
    rotation: Array,
    translation: Array,
    R: Array,
    p: Array,
    J: Array,
) -> None:
    """Computes a frame from the placements of the joints.

    Args:
        task, part: the tasks whose rows are computed, see `jacobian`.
        parent, is_revolute, column, factor: properties of all joints. placed, z: the results of `place_all`.
        joint: (1,), the joint that carries the frame. rotation, translation: the frame's axes (3, 3) and
            origin (1, 3) in that joint's frame.
        R, p, J: the result, (K, 3, 3), (K, 3) and (K, m, n).
    """
    placed, z, rotation, translation = (
        borrowed(placed),
        borrowed(z),
        borrowed(rotation),
        borrowed(translation),
    )
    R, p, J = borrowed(R), borrowed(p), borrowed(J)
    for k in range(len(p)):
        here = p[k : k + 1]
        points(placed[k], joint, translation, here)
        rotation_of_frame(placed[k, joint[0]], rotation, R[k])
        jacobian(
            *(task, part, parent, is_revolute, column, factor, placed[k], z[k]),
            *(joint, here, translation, J[k]),
        )

"""Manipulability ellipsoids: how fast each level can still move its frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from himpc.kinematics.configuration import Configuration
from himpc.stack import Stack
from himpc.tasks import FrameOrientation, FramePosition
from robots.arrays import Array

_GONE = 1e-6
"""Directions in which joints of unit speed move a frame more slowly than this, m/s or rad/s, count as
lost."""


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """The set {ẋ = J_i q̇: ‖q̇‖ ≤ 1, J_p q̇ = 0 for every level p above} of a frame's velocities.

    Attributes:
        level, task: names.
        turns: whether the velocity is an angular velocity.
        position: (3,) m, of the frame.
        axes: (3, 3), orthonormal columns, right-handed: the semi-axes' directions in the world.
        radii: (3,) m/s or rad/s for joints of unit speed, the longest first; 0 in directions without motion.
    """

    level: str
    task: str
    turns: bool
    position: Array
    axes: Array
    radii: Array


def ellipsoids(configuration: Configuration, stack: Stack) -> list[Ellipsoid]:
    """Returns the ellipsoids of all frame tasks of the enabled levels, highest priority first.

    An ellipsoid has only the axes that its task controls. If the task controls x alone, it is a line along x.
    """
    n = configuration.q.size
    free, shapes = np.eye(n), []
    for level in stack:
        if not level.enabled:
            continue
        rows = []
        for task in level.tasks:
            J = task.jacobian(configuration)[0]
            rows.append(J)
            if isinstance(task, (FramePosition, FrameOrientation)):
                own = np.zeros((3, n))
                own[task.components] = J
                axes, radii = _axes(own @ free)
                turns = isinstance(task, FrameOrientation)
                position = np.array(configuration.placement(task.frame).translation)
                shapes.append(Ellipsoid(level.name, task.name, turns, position, axes, radii))
        free = free @ _null_space(np.vstack(rows) @ free)
    return shapes


def _axes(J: Array) -> tuple[Array, Array]:
    """Directions and lengths of the semi-axes of {J z: ‖z‖ ≤ 1}, J (3, d)."""
    left, sigma, _ = np.linalg.svd(np.hstack([J, np.zeros((3, 3))]), full_matrices=True)
    if np.linalg.det(left) < 0:
        left[:, 2] = -left[:, 2]
    return left, np.where(sigma[:3] > _GONE, sigma[:3], 0.0)


def _null_space(A: Array) -> Array:
    """Orthonormal columns that A (m, d) maps to zero, (d, d')."""
    _, sigma, right = np.linalg.svd(A, full_matrices=True)
    return right[int((sigma > _GONE).sum()) :].T

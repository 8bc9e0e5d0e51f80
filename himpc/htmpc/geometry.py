"""Where all joints of a robot are at many configurations at once: trees of revolute and prismatic joints."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.compiled import (
    FRAMES,
    INDICES,
    MATRICES,
    MATRIX,
    VECTOR,
    WHOLE,
    compiled,
    inner,
)
from himpc.geometry import Geometry, geometry
from robots import Robot

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


class Placed(NamedTuple):
    """Joints at configurations k.

    Attributes:
        R: (K, n+1, 3, 3) orientation in the world. p: (K, n+1, 3) m, position. z: (K, n+1, 3) axis.
    """

    R: Array
    p: Array
    z: Array


@inner
def _apply(R: Array, x: Array, y: Array) -> None:
    """y ← R x."""
    for a in range(3):
        y[a] = R[a, 0] * x[0] + R[a, 1] * x[1] + R[a, 2] * x[2]


@compiled(INDICES, MATRICES, MATRIX, MATRIX, INDICES, MATRIX)
def _place(
    parent: Indices, turn: Array, shift: Array, axis: Array, turns: Indices, q: Array
) -> tuple[Array, Array, Array]:
    K, joints = len(q), len(parent)
    R = np.empty((K, joints, 3, 3))
    p, z = np.zeros((K, joints, 3)), np.zeros((K, joints, 3))
    F = np.empty((3, 3))
    for k in range(K):
        R[k, 0] = 0.0
        for a in range(3):
            R[k, 0, a, a] = 1.0
        for j in range(1, joints):
            before, here = R[k, parent[j]], R[k, j]
            x, y, w = axis[j]
            _apply(before, shift[j], p[k, j])
            for a in range(3):
                p[k, j, a] += p[k, parent[j], a]
                for b in range(3):
                    F[a, b] = (
                        before[a, 0] * turn[j, 0, b]
                        + before[a, 1] * turn[j, 1, b]
                        + before[a, 2] * turn[j, 2, b]
                    )
            if turns[j]:
                s, c = np.sin(q[k, j - 1]), np.cos(q[k, j - 1])
                t = 1.0 - c
                for a in range(3):
                    f, g, h = F[a]
                    along = t * (f * x + g * y + h * w)
                    here[a, 0] = c * f + along * x + s * (g * w - h * y)
                    here[a, 1] = c * g + along * y + s * (h * x - f * w)
                    here[a, 2] = c * h + along * w + s * (f * y - g * x)
            else:
                for a in range(3):  # `here[:] = F` would be compiled with all that it takes to word an error
                    for b in range(3):
                        here[a, b] = F[a, b]
            _apply(here, axis[j], z[k, j])
            if not turns[j]:
                for a in range(3):
                    p[k, j, a] += q[k, j - 1] * z[k, j, a]
    return R, p, z


def placed(tree: Geometry, q: Array) -> Placed:
    """All joints at configurations q (K, n)."""
    return Placed(*_place(tree.parent, tree.turn, tree.shift, tree.axis, tree.turns, np.array(q, float)))


@compiled(MATRIX, INDICES, FRAMES, MATRICES, MATRICES, WHOLE, MATRIX, VECTOR)
def _frame(
    moves: Array, turns: Indices, R: Array, p: Array, z: Array, joint: int, turn: Array, shift: Array
) -> tuple[Array, Array, Array]:
    K, n = len(p), moves.shape[1]
    place, at, J = np.empty((K, 3, 3)), np.empty((K, 3)), np.zeros((K, 6, n))
    for k in range(K):
        _apply(R[k, joint], shift, at[k])
        for a in range(3):
            at[k, a] += p[k, joint, a]
            row = R[k, joint, a]
            for b in range(3):
                place[k, a, b] = row[0] * turn[0, b] + row[1] * turn[1, b] + row[2] * turn[2, b]
        for c in range(n):
            if moves[joint, c] == 0.0:
                continue
            axis = z[k, c + 1]
            if turns[c + 1]:
                x, y, w = at[k, 0] - p[k, c + 1, 0], at[k, 1] - p[k, c + 1, 1], at[k, 2] - p[k, c + 1, 2]
                J[k, 0, c] = axis[1] * w - axis[2] * y
                J[k, 1, c] = axis[2] * x - axis[0] * w
                J[k, 2, c] = axis[0] * y - axis[1] * x
                for a in range(3):
                    J[k, 3 + a, c] = axis[a]
            else:
                for a in range(3):
                    J[k, a, c] = axis[a]
    return place, at, J


class Frames(NamedTuple):
    """A frame at configurations k: orientation R (K, 3, 3), position p (K, 3) m, and J (K, 6, n), linear
    over angular, world axes, at the frame's origin."""

    R: Array
    p: Array
    J: Array


def frame_at(robot: Robot, where: Placed, name: str) -> Frames:
    """A frame of the robot, the tip for an empty name, where its joints are as given."""
    tree = geometry(robot)
    return Frames(*_frame(tree.moves, tree.turns, *where, *_mounted(robot, name)))


@lru_cache(maxsize=256)
def _mounted(robot: Robot, name: str) -> tuple[int, Array, Array]:
    """The joint that carries a frame, and the frame's axes and origin in the joint's."""
    frame = robot.model.frames[robot.frame_id(name or robot.tip)]
    place = frame.placement
    return frame.parentJoint, np.ascontiguousarray(place.rotation), np.array(place.translation)

"""Compiled signed distances between spheres and shapes, in closed form, with gradients."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from himpc.compilation.compiled import (
    FLAGS,
    INDICES,
    MATRICES,
    MATRIX,
    NUMBER,
    VECTOR,
    inline_kernel,
    kernel,
)
from himpc.compilation.views import borrowed
from himpc.tick.kernel.kinematics import points
from robots.collision import BOX, FLOOR

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@inline_kernel
def from_ball(x: float, y: float, h: float, radius: float, u: Array) -> float:
    """Returns the distance of a point from a ball about the origin; u: the unit vector away from the ball."""
    away = math.sqrt(x * x + y * y + h * h)
    if away > 0.0:
        u[0], u[1], u[2] = x / away, y / away, h / away
    else:
        u[0], u[1], u[2] = 0.0, 0.0, 1.0
    return away - radius


@inline_kernel
def from_box(x: float, y: float, h: float, rotation: Array, half: Array, u: Array) -> float:
    """The same for a box: the distance from its nearest point; inside, minus the distance to the nearest
    face."""
    nearest, face, squares = -math.inf, 0, 0.0
    for a in range(3):
        out = abs(rotation[0, a] * x + rotation[1, a] * y + rotation[2, a] * h) - half[a]
        if out > nearest:
            nearest, face = out, a
        squares += max(out, 0.0) ** 2
    length = math.sqrt(squares)
    u[0] = u[1] = u[2] = 0.0
    for a in range(3):
        here = rotation[0, a] * x + rotation[1, a] * y + rotation[2, a] * h
        share = max(abs(here) - half[a], 0.0) / length if length > 0.0 else 0.0
        if length == 0.0 and a == face:
            share = 1.0
        for b in range(3):
            u[b] += rotation[b, a] * (share if here >= 0.0 else -share)
    return length if length > 0.0 else nearest


@kernel(
    *(MATRICES, MATRICES, INDICES, MATRIX, INDICES, MATRIX, VECTOR),
    *(INDICES, INDICES, MATRICES, MATRIX, MATRIX, FLAGS, NUMBER),
    *(MATRICES, INDICES, INDICES, INDICES, VECTOR, MATRIX, MATRIX),
)
def near(
    placed: Array,
    z: Array,
    is_revolute: Indices,
    moves: Array,
    joint: Indices,
    centre: Array,
    radius: Array,
    kind: Indices,
    carrier: Indices,
    rotation: Array,
    middle: Array,
    half: Array,
    meets: NDArray[np.bool_],
    within: float,
    centres: Array,
    knot: Indices,
    sphere: Indices,
    shape: Indices,
    distance: Array,
    normal: Array,
    slopes: Array,
) -> int:
    """Finds the pairs of a sphere and a shape that are nearer than `within`, m; returns their number.

    A sphere's distance is that of its centre minus its radius. The gradient is the unit vector from the shape
    to the centre, multiplied by the Jacobian of the relative motion.

    Args:
        placed, z: (K, n+1, …) joints, see `forward_kinematics`. is_revolute, moves: see `Geometry`.
        joint, centre, radius, kind, carrier, rotation, middle, half, meets: see `Surroundings`.
        centres: scratch, (K, S, 3).
        knot, sphere, shape: indices of each pair, space for all; the result.
        distance, normal: m, and the unit vector, world axes; the result.
        slopes: the gradients, space for all or for none.
    """
    K, n, S, B = len(placed), moves.shape[1], len(radius), len(kind)
    placed, z, centres, normal = borrowed(placed), borrowed(z), borrowed(centres), borrowed(normal)
    rotation, middle, half, slopes = borrowed(rotation), borrowed(middle), borrowed(half), borrowed(slopes)
    for k in range(K):
        points(placed[k], joint, centre, centres[k])
    count = 0
    for o in range(B):
        c = carrier[o]
        for k in range(K):
            R = placed[k, c]
            for s in range(S):
                if not meets[o, s]:
                    continue
                # The vector from the shape's centre to the sphere's, in the axes of the shape's carrier.
                u, C = normal[count], centres[k, s]
                x, y, h = C[0] - R[9], C[1] - R[10], C[2] - R[11]
                x, y, h = (
                    R[0] * x + R[3] * y + R[6] * h - middle[o, 0],
                    R[1] * x + R[4] * y + R[7] * h - middle[o, 1],
                    R[2] * x + R[5] * y + R[8] * h - middle[o, 2],
                )
                if kind[o] == FLOOR:
                    found = h
                    u[0], u[1], u[2] = 0.0, 0.0, 1.0
                elif kind[o] == BOX:
                    found = from_box(x, y, h, rotation[o], half[o], u)
                else:
                    found = from_ball(x, y, h, half[o, 0], u)
                found -= radius[s]
                # A distance that is NaN does not count as near.
                if not found <= within:
                    continue
                x, y, h = u[0], u[1], u[2]
                for a in range(3):
                    u[a] = R[3 * a] * x + R[3 * a + 1] * y + R[3 * a + 2] * h
                knot[count], sphere[count], shape[count], distance[count] = k, s, o, found
                count += 1
    for r in range(min(count, len(slopes))):
        k, s, c = knot[r], sphere[r], carrier[shape[r]]
        u, C = normal[r], centres[k, s]
        for j in range(1, n + 1):
            slopes[r, j - 1] = 0.0
            # A joint that moves both does not change their distance.
            sign = moves[joint[s], j - 1] - moves[c, j - 1]
            if sign == 0.0:
                continue
            w, on = z[k, j], placed[k, j]
            if is_revolute[j]:
                x, y, h = C[0] - on[9], C[1] - on[10], C[2] - on[11]
                along = (
                    u[0] * (w[1] * h - w[2] * y) + u[1] * (w[2] * x - w[0] * h) + u[2] * (w[0] * y - w[1] * x)
                )
            else:
                along = u[0] * w[0] + u[1] * w[1] + u[2] * w[2]
            slopes[r, j - 1] = sign * along
    return count
